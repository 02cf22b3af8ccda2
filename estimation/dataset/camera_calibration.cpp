#include "estimation/dataset/camera_calibration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace dive::estimation {
namespace {

using Failure = tl::unexpected<std::string>;

constexpr std::array<std::string_view, 4> kRadtanNames{"radial-tangential", "radtan", "plumb_bob",
                                                       "rational_polynomial"};
constexpr std::array<std::string_view, 2> kEquidistantNames{"equidistant", "equi"};
constexpr std::string_view kNoneName = "none";

enum class Distortion { kNone, kRadtan, kEquidistant };

template <std::size_t N>
bool contains(const std::array<std::string_view, N>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

struct Projection {
  std::string_view name;
  LensModel lens;
  std::size_t parameters;  // of the lens, before fu, fv, pu, pv
};

// Omni becomes EUCM once its numbers are read.
constexpr std::array<Projection, 4> kProjections{{{"pinhole", LensModel::kPinhole, 0},
                                                  {"omni", LensModel::kEucm, 1},
                                                  {"eucm", LensModel::kEucm, 2},
                                                  {"ds", LensModel::kDoubleSphere, 2}}};

tl::expected<Projection, std::string> read_projection(const SensorFile& file) {
  const auto word = file.word("camera_model");
  if (!word) return Failure(word.error());
  const std::string name = word->value_or("pinhole");
  for (const Projection& projection : kProjections) {
    if (projection.name == name) return projection;
  }
  return Failure(
      file.at("camera_model",
              fmt::format("camera_model is {}; known are pinhole, omni, eucm and ds", name)));
}

tl::expected<Distortion, std::string> read_distortion(const SensorFile& file,
                                                      const Projection& projection) {
  const bool is_pinhole = projection.lens == LensModel::kPinhole;
  const auto word = file.word("distortion_model");
  if (!word) return Failure(word.error());
  if (!*word) return is_pinhole ? Distortion::kRadtan : Distortion::kNone;
  if (contains(kRadtanNames, **word)) return Distortion::kRadtan;
  if (**word == kNoneName) return Distortion::kNone;
  if (!contains(kEquidistantNames, **word)) {
    return Failure(
        file.at("distortion_model",
                fmt::format("distortion_model is {}; known are {}, {} and none", **word,
                            fmt::join(kRadtanNames, ", "), fmt::join(kEquidistantNames, ", "))));
  }
  if (is_pinhole) return Distortion::kEquidistant;
  return Failure(file.at("distortion_model",
                         fmt::format("distortion_model {} belongs to camera_model pinhole, not {}",
                                     **word, projection.name)));
}

tl::expected<std::vector<double>, std::string> read_coefficients(const SensorFile& file,
                                                                 Distortion distortion) {
  constexpr const char* kKey = "distortion_coefficients";
  if (distortion == Distortion::kEquidistant) return file.numbers(kKey, {4});
  if (distortion == Distortion::kRadtan) return file.numbers(kKey, {0, 4, 5, 8});
  if (!file.has(kKey)) return std::vector<double>();
  return file.numbers(kKey, {0});
}

// The unified model x / (z + xi |p|) as EUCM: a plane 1 + xi times as near, on which the distortion
// has other coefficients.
void from_omni(double xi, CameraModel& model) {
  const double scale = 1.0 + xi;
  model.lens_parameters = {xi / scale, 1.0};
  model.fx /= scale;
  model.fy /= scale;
  constexpr std::array<int, 8> kPowers{2, 4, 1, 1, 6, 2, 4, 6};
  for (std::size_t i = 0; i < kPowers.size(); ++i) {
    model.radtan[i] /= std::pow(scale, kPowers[i]);
  }
}

}  // namespace

tl::expected<CameraModel, std::string> read_camera_model(const SensorFile& file) {
  const auto projection = read_projection(file);
  if (!projection) return Failure(projection.error());
  const auto distortion = read_distortion(file, *projection);
  if (!distortion) return Failure(distortion.error());
  const auto size = file.numbers("resolution", {2});
  if (!size) return Failure(size.error());
  const std::size_t first = projection->parameters;
  const auto intrinsics = file.numbers("intrinsics", {first + 4});
  if (!intrinsics) return Failure(intrinsics.error());
  const auto coefficients = read_coefficients(file, *distortion);
  if (!coefficients) return Failure(coefficients.error());
  for (const double side : *size) {
    if (side >= 1.0 && side <= 20'000.0) continue;
    return Failure(
        file.at("resolution", fmt::format("an image of {} x {} pixels", (*size)[0], (*size)[1])));
  }

  const auto index = file.number("refractive_index");
  if (!index) return Failure(index.error());
  const auto line_time = file.number("line_time_s");
  if (!line_time) return Failure(line_time.error());

  CameraModel model;
  model.refractive_index = index->value_or(1.0);
  model.line_time_s = line_time->value_or(0.0);
  model.width = static_cast<int>((*size)[0]);
  model.height = static_cast<int>((*size)[1]);
  model.fx = (*intrinsics)[first];
  model.fy = (*intrinsics)[first + 1];
  model.cx = (*intrinsics)[first + 2];
  model.cy = (*intrinsics)[first + 3];
  const bool is_equidistant = *distortion == Distortion::kEquidistant;
  model.lens = is_equidistant ? LensModel::kEquidistant : projection->lens;
  std::copy_n(intrinsics->begin(), first, model.lens_parameters.begin());
  std::copy(coefficients->begin(), coefficients->end(),
            is_equidistant ? model.lens_parameters.begin() : model.radtan.begin());
  if (projection->name == "omni") {
    const double xi = intrinsics->front();
    if (!(xi >= 0.0)) {
      return Failure(file.at("intrinsics", fmt::format("xi is {} but must be at least 0", xi)));
    }
    from_omni(xi, model);
  }
  return model;
}

std::string camera_model_yaml(const CameraModel& camera) {
  const auto& p = camera.lens_parameters;
  const auto& k = camera.radtan;
  std::string name = "pinhole";
  std::string parameters;
  std::string_view names;
  if (camera.lens == LensModel::kEucm) {
    name = "eucm";
    names = "alpha, beta, ";
  } else if (camera.lens == LensModel::kDoubleSphere) {
    name = "ds";
    names = "xi, alpha, ";
  }
  if (!names.empty()) parameters = fmt::format("{}, {}, ", p[0], p[1]);
  std::string distortion = "radial-tangential";
  std::vector<double> coefficients(k.begin(), k.begin() + 4);
  if (camera.lens == LensModel::kEquidistant) {
    distortion = "equidistant";
    coefficients.assign(p.begin(), p.end());
  } else if (std::any_of(k.begin() + 4, k.end(), [](double value) { return value != 0.0; })) {
    coefficients.assign(k.begin(), k.end());
  }
  return fmt::format(
      "resolution: [{}, {}]\ncamera_model: {}\n"
      "intrinsics: [{}{}, {}, {}, {}]  # {}fu, fv, cu, cv\n"
      "distortion_model: {}\ndistortion_coefficients: [{}]\n"
      "refractive_index: {}\nline_time_s: {}\n",
      camera.width, camera.height, name, parameters, camera.fx, camera.fy, camera.cx, camera.cy,
      names, distortion, fmt::join(coefficients, ", "), camera.refractive_index,
      camera.line_time_s);
}

}  // namespace dive::estimation
