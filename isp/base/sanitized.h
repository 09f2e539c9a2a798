#pragma once

/// LOWLUX_SANITIZED is defined where the address, thread or memory sanitizer has the heap, and LOWLUX_ADDRESS_SANITIZED
/// where it is the first of them. GCC and clang say so in different words.
#if defined(__SANITIZE_ADDRESS__)
#define LOWLUX_ADDRESS_SANITIZED 1
#elif defined(__SANITIZE_THREAD__)
#define LOWLUX_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LOWLUX_ADDRESS_SANITIZED 1
#elif __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define LOWLUX_SANITIZED 1
#endif
#endif
#if defined(LOWLUX_ADDRESS_SANITIZED)
#define LOWLUX_SANITIZED 1
#endif
