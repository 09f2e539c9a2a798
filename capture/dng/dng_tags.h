#pragma once

#include "capture/dng/tiff_directory.h"

/// This header has tags by the names of TIFF 6.0, TIFF/EP, EXIF 2.31 and DNG 1.4.
namespace lowlux::capture::tag {

inline constexpr TagName new_subfile_type{254, "NewSubfileType"};
inline constexpr TagName image_width{256, "ImageWidth"};
inline constexpr TagName image_length{257, "ImageLength"};
inline constexpr TagName bits_per_sample{258, "BitsPerSample"};
inline constexpr TagName compression{259, "Compression"};
inline constexpr TagName photometric{262, "PhotometricInterpretation"};
inline constexpr TagName fill_order{266, "FillOrder"};
inline constexpr TagName make{271, "Make"};
inline constexpr TagName model{272, "Model"};
inline constexpr TagName strip_offsets{273, "StripOffsets"};
inline constexpr TagName orientation{274, "Orientation"};
inline constexpr TagName samples_per_pixel{277, "SamplesPerPixel"};
inline constexpr TagName rows_per_strip{278, "RowsPerStrip"};
inline constexpr TagName strip_byte_counts{279, "StripByteCounts"};
inline constexpr TagName planar_configuration{284, "PlanarConfiguration"};
inline constexpr TagName software{305, "Software"};
inline constexpr TagName date_time{306, "DateTime"};
inline constexpr TagName predictor{317, "Predictor"};
inline constexpr TagName tile_width{322, "TileWidth"};
inline constexpr TagName tile_length{323, "TileLength"};
inline constexpr TagName tile_offsets{324, "TileOffsets"};
inline constexpr TagName tile_byte_counts{325, "TileByteCounts"};
inline constexpr TagName sub_ifds{330, "SubIFDs"};
inline constexpr TagName sample_format{339, "SampleFormat"};
inline constexpr TagName cfa_repeat_pattern_dim{33421, "CFARepeatPatternDim"};
inline constexpr TagName cfa_pattern{33422, "CFAPattern"};

inline constexpr TagName exif_ifd{34665, "ExifIFD"};
inline constexpr TagName exposure_time{33434, "ExposureTime"};
inline constexpr TagName f_number{33437, "FNumber"};
inline constexpr TagName iso{34855, "PhotographicSensitivity"};
inline constexpr TagName recommended_exposure_index{34866, "RecommendedExposureIndex"};
inline constexpr TagName date_time_original{36867, "DateTimeOriginal"};
inline constexpr TagName focal_length{37386, "FocalLength"};
inline constexpr TagName ambient_temperature{37888, "AmbientTemperature"};

inline constexpr TagName dng_version{50706, "DNGVersion"};
inline constexpr TagName dng_backward_version{50707, "DNGBackwardVersion"};
inline constexpr TagName unique_camera_model{50708, "UniqueCameraModel"};
inline constexpr TagName cfa_plane_color{50710, "CFAPlaneColor"};
inline constexpr TagName cfa_layout{50711, "CFALayout"};
inline constexpr TagName linearization_table{50712, "LinearizationTable"};
inline constexpr TagName black_level_repeat_dim{50713, "BlackLevelRepeatDim"};
inline constexpr TagName black_level{50714, "BlackLevel"};
inline constexpr TagName black_level_delta_h{50715, "BlackLevelDeltaH"};
inline constexpr TagName black_level_delta_v{50716, "BlackLevelDeltaV"};
inline constexpr TagName white_level{50717, "WhiteLevel"};
inline constexpr TagName default_scale{50718, "DefaultScale"};
inline constexpr TagName default_crop_origin{50719, "DefaultCropOrigin"};
inline constexpr TagName default_crop_size{50720, "DefaultCropSize"};
inline constexpr TagName color_matrix[] = {{50721, "ColorMatrix1"}, {50722, "ColorMatrix2"}};
inline constexpr TagName camera_calibration[] = {{50723, "CameraCalibration1"}, {50724, "CameraCalibration2"}};
inline constexpr TagName camera_calibration_signature{50931, "CameraCalibrationSignature"};
inline constexpr TagName profile_calibration_signature{50932, "ProfileCalibrationSignature"};
inline constexpr TagName analog_balance{50727, "AnalogBalance"};
inline constexpr TagName as_shot_neutral{50728, "AsShotNeutral"};
inline constexpr TagName as_shot_white_xy{50729, "AsShotWhiteXY"};
inline constexpr TagName baseline_exposure{50730, "BaselineExposure"};
inline constexpr TagName dng_private_data{50740, "DNGPrivateData"};
inline constexpr TagName calibration_illuminant[] = {{50778, "CalibrationIlluminant1"},
                                                     {50779, "CalibrationIlluminant2"}};
inline constexpr TagName active_area{50829, "ActiveArea"};
inline constexpr TagName masked_areas{50830, "MaskedAreas"};
inline constexpr TagName noise_reduction_applied{50935, "NoiseReductionApplied"};
inline constexpr TagName forward_matrix[] = {{50964, "ForwardMatrix1"}, {50965, "ForwardMatrix2"}};
inline constexpr TagName row_interleave_factor{50975, "RowInterleaveFactor"};
inline constexpr TagName opcode_list[] = {{51008, "OpcodeList1"}, {51009, "OpcodeList2"}, {51022, "OpcodeList3"}};
inline constexpr TagName noise_profile{51041, "NoiseProfile"};
inline constexpr TagName default_user_crop{51125, "DefaultUserCrop"};
inline constexpr TagName profile_gain_table_map{52525, "ProfileGainTableMap"};
inline constexpr TagName color_matrix_3{52531, "ColorMatrix3"};
inline constexpr TagName rgb_tables{52543, "RGBTables"};
inline constexpr TagName profile_gain_table_map2{52544, "ProfileGainTableMap2"};
inline constexpr TagName column_interleave_factor{52547, "ColumnInterleaveFactor"};

/// Values of PhotometricInterpretation.
inline constexpr std::uint32_t photometric_cfa = 32803;
inline constexpr std::uint32_t photometric_linear_raw = 34892;

/// Values of Compression.
inline constexpr std::uint32_t compression_none = 1;
inline constexpr std::uint32_t compression_jpeg = 7;
inline constexpr std::uint32_t compression_deflate = 8;
inline constexpr std::uint32_t compression_vc5 = 9;
inline constexpr std::uint32_t compression_lossy_jpeg = 34892;
inline constexpr std::uint32_t compression_old_deflate = 32946;
inline constexpr std::uint32_t compression_jpeg_xl = 52546;

}  // namespace lowlux::capture::tag
