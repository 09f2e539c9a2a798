#include "isp/codec/stored_rows.h"

#include <zlib.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <new>

namespace lowlux::isp {

struct StoredRows::Inflater {
  Inflater() {
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  ~Inflater() { inflateEnd(&stream); }

  void open(std::span<const std::byte> part) {
    inflateReset(&stream);
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(part.data()));  // zlib only reads it
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(part.size(), std::numeric_limits<uInt>::max()));
  }
  bool fill(std::span<std::byte> out) {
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const int outcome = inflate(&stream, Z_SYNC_FLUSH);
    return (outcome == Z_OK || outcome == Z_STREAM_END) && stream.avail_out == 0;
  }

  /// Reads on, with space for a byte, so that a stream that ends is read to its checksum.
  bool is_at_end() {
    Bytef more = 0;
    stream.next_out = &more;
    stream.avail_out = 1;
    const int outcome = inflate(&stream, Z_SYNC_FLUSH);
    return outcome == Z_STREAM_END || outcome == Z_BUF_ERROR;  // the latter: it ends without a checksum
  }

  z_stream stream{};
};

StoredRows::StoredRows(bool deflated, std::size_t row_bytes) : row_bytes_(row_bytes) {
  assert(row_bytes > 0);
  if (!deflated) return;
  inflater_ = std::make_unique<Inflater>();
  inflated_.resize(row_bytes);
}

StoredRows::~StoredRows() = default;

void StoredRows::open(std::span<const std::byte> part) {
  rest_ = part;
  if (inflater_) inflater_->open(part);
}

std::optional<std::span<const std::byte>> StoredRows::next() {
  if (inflater_) {
    if (!inflater_->fill(inflated_)) return std::nullopt;
    return inflated_;
  }
  if (rest_.size() < row_bytes_) return std::nullopt;
  const auto row = rest_.first(row_bytes_);
  rest_ = rest_.subspan(row_bytes_);
  return row;
}

bool StoredRows::ends_within(int rows) {
  if (!inflater_) return true;
  for (int i = 0; i < rows; ++i) {
    if (!inflater_->fill(inflated_)) break;
  }
  return inflater_->is_at_end();
}

}  // namespace lowlux::isp
