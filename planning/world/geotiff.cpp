#include "planning/world/geotiff.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <cpl_error.h>
#include <cpl_vsi.h>
#include <dlfcn.h>
#include <fmt/format.h>
#include <gdal.h>
#include <gdal_frmts.h>
#include <ogr_srs_api.h>

#include "common/source_text.h"

namespace dive::planning {
namespace {

constexpr double kMaxBlock = 16'777'216.0;  // cells; GDAL decodes a whole one
constexpr double kSquare = 1e-6;            // relative

/// The functions of GDAL that are used.
struct Gdal {
  decltype(&GDALRegister_GTiff) register_driver;
  decltype(&GDALOpenEx) open;
  decltype(&GDALClose) close;
  decltype(&GDALGetRasterXSize) columns;
  decltype(&GDALGetRasterYSize) rows;
  decltype(&GDALGetRasterCount) bands;
  decltype(&GDALGetGeoTransform) transform;
  decltype(&GDALGetSpatialRef) projection;
  decltype(&OSRIsGeographic) is_geographic;
  decltype(&OSRGetLinearUnits) unit_m;
  decltype(&GDALGetRasterBand) band;
  decltype(&GDALGetMaskBand) mask;
  decltype(&GDALGetBlockSize) block_size;
  decltype(&GDALGetRasterUnitType) height_unit;
  decltype(&GDALGetRasterScale) scale;
  decltype(&GDALGetRasterOffset) offset;
  decltype(&GDALRasterIO) read;
  decltype(&VSIFileFromMemBuffer) file_of;
  decltype(&VSIFCloseL) close_file;
  decltype(&VSIUnlink) remove_file;
  decltype(&CPLPushErrorHandler) push_errors;
  decltype(&CPLPopErrorHandler) pop_errors;
  decltype(&CPLQuietErrorHandler) quiet;
  decltype(&CPLGetLastErrorMsg) last_error;
};

/// Nothing without the library.
std::unique_ptr<Gdal> load_gdal() {
  // Never closed: its own threads and caches live to the end of the process.
  void* const library = dlopen(DIVE_GDAL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return nullptr;
  auto gdal = std::make_unique<Gdal>();
  bool has_all = true;
  const auto find = [&](const char* name, auto& function) {
    void* const symbol = dlsym(library, name);
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(symbol);
    has_all = has_all && symbol != nullptr;
  };
  find("GDALRegister_GTiff", gdal->register_driver);
  find("GDALOpenEx", gdal->open);
  find("GDALClose", gdal->close);
  find("GDALGetRasterXSize", gdal->columns);
  find("GDALGetRasterYSize", gdal->rows);
  find("GDALGetRasterCount", gdal->bands);
  find("GDALGetGeoTransform", gdal->transform);
  find("GDALGetSpatialRef", gdal->projection);
  find("OSRIsGeographic", gdal->is_geographic);
  find("OSRGetLinearUnits", gdal->unit_m);
  find("GDALGetRasterBand", gdal->band);
  find("GDALGetMaskBand", gdal->mask);
  find("GDALGetBlockSize", gdal->block_size);
  find("GDALGetRasterUnitType", gdal->height_unit);
  find("GDALGetRasterScale", gdal->scale);
  find("GDALGetRasterOffset", gdal->offset);
  find("GDALRasterIO", gdal->read);
  find("VSIFileFromMemBuffer", gdal->file_of);
  find("VSIFCloseL", gdal->close_file);
  find("VSIUnlink", gdal->remove_file);
  find("CPLPushErrorHandler", gdal->push_errors);
  find("CPLPopErrorHandler", gdal->pop_errors);
  find("CPLQuietErrorHandler", gdal->quiet);
  find("CPLGetLastErrorMsg", gdal->last_error);
  if (!has_all) return nullptr;
  gdal->register_driver();  // alone: GDAL tries the formats that are registered
  return gdal;
}

/// A GeoTIFF in memory, so that no file beside it is read, and none while it changes.
class TiffInMemory {
 public:
  /// `content` must outlive this object.
  TiffInMemory(const Gdal& gdal, const std::string& content) : gdal_(gdal) {
    gdal_.push_errors(gdal_.quiet);
    name_ = fmt::format("/vsimem/dive-{}.tif", static_cast<const void*>(content.data()));
    auto* const bytes =
        reinterpret_cast<GByte*>(const_cast<char*>(content.data()));  // is opened for reading
    VSILFILE* const file = gdal_.file_of(name_.c_str(), bytes, content.size(), FALSE);
    if (file == nullptr) return;
    gdal_.close_file(file);
    const std::array<const char*, 2> drivers{"GTiff", nullptr};
    const std::string own_name = name_.substr(name_.rfind('/') + 1);
    const std::array<const char*, 2> siblings{own_name.c_str(), nullptr};
    dataset_ = gdal_.open(name_.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY | GDAL_OF_VERBOSE_ERROR,
                          drivers.data(), nullptr, siblings.data());
  }
  ~TiffInMemory() {
    if (dataset_ != nullptr) gdal_.close(dataset_);
    gdal_.remove_file(name_.c_str());
    gdal_.pop_errors();
  }
  TiffInMemory(const TiffInMemory&) = delete;
  TiffInMemory& operator=(const TiffInMemory&) = delete;

  tl::expected<HeightGrid, std::string> read() const {
    if (dataset_ == nullptr) return refuse("it is no GeoTIFF that can be read: {}", reason());
    if (const int bands = gdal_.bands(dataset_); bands != 1) {
      return refuse("it has {} bands: keep the one of the heights, as with gdal_translate -b 1",
                    bands);
    }
    if (const std::string problem = problem_of_units(); !problem.empty()) {
      return tl::unexpected(problem);
    }
    HeightGrid grid;
    if (const std::string problem = place(grid); !problem.empty()) return tl::unexpected(problem);
    if (const std::string problem = read_heights(grid); !problem.empty()) {
      return tl::unexpected(problem);
    }
    return grid;
  }

 private:
  template <class... Values>
  static tl::unexpected<std::string> refuse(fmt::format_string<Values...> why, Values&&... values) {
    return tl::unexpected(fmt::format(why, std::forward<Values>(values)...));
  }

  std::string reason() const {
    const std::string_view reason = gdal_.last_error();
    return std::string(reason.empty() ? "GDAL gives no reason" : reason);
  }

  GDALRasterBandH band() const { return gdal_.band(dataset_, 1); }

  // Empty, or what is not in metres.
  std::string problem_of_units() const {
    if (OGRSpatialReferenceH projection = gdal_.projection(dataset_); projection != nullptr) {
      if (gdal_.is_geographic(projection) != 0) {
        return fmt::format("its coordinates are degrees of latitude and longitude: {}",
                           kProjectGrid);
      }
      if (const double unit_m = gdal_.unit_m(projection, nullptr); unit_m != 1.0) {
        return fmt::format("its coordinates have a unit of {:g} m: {}", unit_m, kProjectGrid);
      }
    }
    constexpr std::array<std::string_view, 4> kMetres{"", "m", "metre", "meter"};
    const std::string_view unit = gdal_.height_unit(band());
    if (std::ranges::find(kMetres, unit) == kMetres.end()) {
      return fmt::format(
          "its heights are in \"{}\", not in metres: convert them, as with gdal_calc",
          unit.substr(0, 40));
    }
    if (gdal_.scale(band(), nullptr) != 1.0 || gdal_.offset(band(), nullptr) != 0.0) {
      return "its values are scaled: write the heights themselves, as with gdal_translate -unscale";
    }
    return {};
  }

  // Sets all but the heights. Empty, or what is wrong.
  std::string place(HeightGrid& grid) const {
    // x = t0 + t1 column + t2 row, y = t3 + t4 column + t5 row, of the corners of cells
    std::array<double, 6> t{};
    if (gdal_.transform(dataset_, t.data()) != CE_None) {
      return "it does not say where it lies: give it a place, as with gdal_translate -a_ullr";
    }
    const double cell = t[1];
    if (t[2] != 0.0 || t[4] != 0.0 || !(cell > 0.0) || !(std::abs(t[5] + cell) <= kSquare * cell)) {
      return "its cells must be square, with north up: resample it, as with gdalwarp -tr 2 2";
    }
    const int columns = gdal_.columns(dataset_);
    const int rows = gdal_.rows(dataset_);
    if (const std::string problem = grid_problem(columns, rows, cell); !problem.empty()) {
      return problem;
    }
    grid.columns = static_cast<std::size_t>(columns);
    grid.rows = static_cast<std::size_t>(rows);
    grid.cell = cell;
    grid.west = t[0] + 0.5 * cell;
    grid.south = t[3] + (static_cast<double>(rows) - 0.5) * t[5];
    return {};
  }

  template <class Value>
  bool read_all(GDALRasterBandH from, GDALDataType type, const HeightGrid& grid,
                std::vector<Value>& values) const {
    const int columns = static_cast<int>(grid.columns);
    const int rows = static_cast<int>(grid.rows);
    values.resize(grid.columns * grid.rows);
    return gdal_.read(from, GF_Read, 0, 0, columns, rows, values.data(), columns, rows, type, 0,
                      0) == CE_None;
  }

  // Empty, or what is wrong.
  std::string read_heights(HeightGrid& grid) const {
    int block_columns = 0;
    int block_rows = 0;
    gdal_.block_size(band(), &block_columns, &block_rows);
    if (static_cast<double>(block_columns) * block_rows > kMaxBlock) {
      return "its tiles are too large: write it again, as with gdal_translate";
    }
    std::vector<std::uint8_t> mask;
    if (!read_all(band(), GDT_Float64, grid, grid.heights) ||
        !read_all(gdal_.mask(band()), GDT_Byte, grid, mask)) {
      return fmt::format("its heights cannot be read: {}", reason());
    }
    for (std::size_t i = 0; i < mask.size(); ++i) {
      double& height = grid.heights[i];
      if (mask[i] == 0) {
        height = std::numeric_limits<double>::quiet_NaN();
      } else if (!is_height(height)) {
        return fmt::format(
            "row {}, column {}: {:g} is no height in metres: is it the value of cells without "
            "data? Then write it into the file, as with gdal_translate -a_nodata {:g}",
            i / grid.columns + 1, i % grid.columns + 1, height, height);
      }
    }
    return {};
  }

  const Gdal& gdal_;
  std::string name_;
  GDALDatasetH dataset_ = nullptr;
};

}  // namespace

tl::expected<HeightGrid, std::string> read_geotiff(const std::string& path) {
  static const std::unique_ptr<Gdal> gdal = load_gdal();
  if (!gdal) {
    return tl::unexpected(fmt::format(
        "it is a GeoTIFF, and GDAL ({}) is not on this computer: install it, or convert "
        "the grid on another one with gdal_translate -of AAIGrid {} grid.asc",
        DIVE_GDAL_LIBRARY, path));
  }
  const tl::expected<SourceText, std::string> file = read_source_text(path, kMaxGridBytes);
  if (!file) return tl::unexpected(file.error());
  return TiffInMemory(*gdal, file->content()).read();
}

}  // namespace dive::planning
