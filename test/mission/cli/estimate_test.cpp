// `dive estimate`: on a recording that the tests write. The primitive estimator uses no images, so
// the recording has none; test/estimation/dataset tests the visual one, and this file runs it on
// the output of `dive run --record`.

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "test/common/sanitizers.h"
#include "test/estimation/dataset/bag_writer.h"
#include "test/mission/cli/own_folder.h"

namespace dive::mission {
namespace {

namespace fs = std::filesystem;
using testing::content_of;
using ::testing::HasSubstr;
using testing::own_folder;
using testing::Ran;
using testing::run_here;
using testing::write_here;

/// Twenty seconds along x at 0.4 m/s, 2 m deep, as folder `swim`.
void write_swim() {
  const std::string unit = "T_BS:\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  std::string imu;
  std::string images;
  std::string depth;
  std::string truth = "#timestamp, p, q\n";
  for (long k = 0; k <= 4000; ++k) {
    const long ns = 5'000'000 * (k + 1);
    imu += fmt::format("{},0,0,0,0,0,9.81\n", ns);
    if (k % 10 != 0) continue;
    images += fmt::format("{},{}.png\n", ns, ns);
    depth += fmt::format("{},2.0\n", ns);
    truth += fmt::format("{},{},0,-2,1,0,0,0\n", ns, 0.002 * static_cast<double>(k));
  }
  write_here("swim/mav0/imu0/sensor.yaml", unit);
  write_here("swim/mav0/imu0/data.csv", imu);
  write_here("swim/mav0/cam0/sensor.yaml",
             unit +
                 "resolution: [752, 480]\nintrinsics: [400, 400, 376, 240]\n"
                 "distortion_coefficients: [0, 0, 0, 0]\n");
  write_here("swim/mav0/cam0/data.csv", images);
  write_here("swim/mav0/depth0/data.csv", depth);
  write_here("swim/mav0/state_groundtruth_estimate0/data.csv", truth);
}

// End to end: a dive, its images on disk, and the estimate computed from them.
TEST(Estimate, FindsItsWayOnARecordingOfADive) {
  DIVE_SKIP_UNDER_SANITIZERS("hundreds of pictures are drawn and written");
  const fs::path missions = fs::path(DIVE_SOURCE_DIR) / "missions/scenarios/missions";
  std::string mission = content_of(missions / "basin_visual_inertial.xml");
  for (const auto& [from, to] :
       {std::pair{"visual_inertial", "primitive"},
        std::pair{R"(<goto id="east" x="4")", R"(<goto id="east" x="1")"}}) {
    ASSERT_NE(mission.find(from), std::string::npos) << from;
    mission.replace(mission.find(from), std::string(from).size(), to);
  }
  write_here("short.xml", mission);
  write_here("maps/basin.sdf", content_of(missions / "maps/basin.sdf"));
  const fs::path data = own_folder() / "data";
  fs::remove_all(data);  // left by an interrupted run
  const Ran dived = run_here("run short.xml --record data --json");
  ASSERT_EQ(dived.status, 0) << dived.out << dived.err;

  const Ran ran = run_here("estimate data --init truth --json");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  const double seconds = nlohmann::json::parse(dived.out).at("duration_s").get<double>();
  EXPECT_NEAR(json["frames"].get<double>(), 20.0 * seconds, 25.0) << "twenty pairs a second";
  EXPECT_NEAR(json["duration_s"].get<double>(), seconds, 1.0);
  EXPECT_LT(json["ate_m"].get<double>(), 0.05);
  EXPECT_GT(json["mean_features"].get<double>(), 30.0);
  ASSERT_EQ(json["cameras"].size(), 2U);
  EXPECT_EQ(json["cameras"][1]["refractive_index"], 1.0);

  // The simulated cameras are exact, which the recording states.
  for (const char* camera : {"cam0", "cam1"}) {
    const std::string name = fmt::format("data/mav0/{}/sensor.yaml", camera);
    std::string sensor = content_of(data.parent_path() / name);
    const std::size_t at = sensor.find("focal_sigma: 0 ");
    ASSERT_NE(at, std::string::npos);
    write_here(name, sensor.replace(at, 14, "focal_sigma: 0.005"));
  }
  const Ran calibrated = run_here("estimate data --init truth");
  EXPECT_EQ(calibrated.status, 0) << calibrated.err;
  EXPECT_THAT(calibrated.out, HasSubstr("camera 1 focal lengths"));

  const Ran again = run_here("estimate data --estimator primitive --speed 0.25 --json");
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_LT(nlohmann::json::parse(again.out).at("ate_m").get<double>(), 0.5);
  fs::remove_all(data);  // 50 MB
}

TEST(Estimate, PrintsTheErrorAsJson) {
  write_swim();
  const Ran ran =
      run_here("estimate swim --estimator primitive --speed 0.4 --json --output out.tum");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto json = nlohmann::json::parse(ran.out);
  EXPECT_EQ(json["frames"], 401);
  EXPECT_NEAR(json["duration_s"].get<double>(), 20.0, 1e-9);
  EXPECT_NEAR(json["distance_m"].get<double>(), 8.0, 0.05);
  EXPECT_LT(json["ate_m"].get<double>(), 0.5);
  // Static initialisation requires the vehicle at rest, and this one swims from the beginning.
  EXPECT_GT(json["drift_percent"].get<double>(), 0.5);
  EXPECT_LT(json["drift_percent"].get<double>(), 15.0);
  EXPECT_GE(json["nees_position"].get<double>(), 0.0);
  EXPECT_LT(json["nees_orientation"].get<double>(), 3.0);
  EXPECT_GE(json["ms_per_frame"]["p99"].get<double>(), 0.0);
  EXPECT_GE(json["ms_per_frame"]["mean"].get<double>(), 0.0);
  EXPECT_EQ(json["imu"]["samples"], 4001);
  EXPECT_EQ(json["imu"]["gaps"], 0);
  EXPECT_EQ(json["depth"]["samples"], 401);
  EXPECT_EQ(json["velocity"]["samples"], 0);
  EXPECT_FALSE(json.contains("restarts")) << "of the visual-inertial estimator";

  std::ifstream tum(own_folder() / "out.tum");
  std::string line;
  int lines = 0;
  while (std::getline(tum, line)) ++lines;
  EXPECT_GT(lines, 390);
}

TEST(Estimate, PrintsTheErrorAsText) {
  write_swim();
  const Ran ran = run_here("estimate swim --estimator primitive");
  EXPECT_EQ(ran.status, 0) << ran.err;
  for (const char* words : {"401 images in 20.0 s", "ATE", "RPE", "drift", "NEES", "time",
                            "IMU      4001 samples, no gaps", "depth    401 samples"}) {
    EXPECT_THAT(ran.out, HasSubstr(words));
  }
}

TEST(Estimate, RefusesWhatItCannotRead) {
  const Ran none = run_here("estimate nowhere");
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("nowhere: no such file"));
  write_here("empty/file.txt", "");
  EXPECT_THAT(run_here("estimate empty").err, HasSubstr("empty: no dataset in the ASL format"));
  const Ran missing = run_here("estimate nowhere.bag --calibration c.yaml");
  EXPECT_EQ(missing.status, 2);
  EXPECT_THAT(missing.err, HasSubstr("nowhere.bag: no such file"));
  EXPECT_EQ(run_here("estimate").status, 2);
  EXPECT_EQ(run_here("estimate swim --init somehow").status, 2);
  write_swim();
  const Ran loops = run_here("estimate swim --estimator primitive --loops");
  EXPECT_EQ(loops.status, 2);
  EXPECT_THAT(loops.err, HasSubstr("two cameras"));
  const Ran blind = run_here("estimate swim");  // there are no images
  EXPECT_EQ(blind.status, 2);
  EXPECT_THAT(blind.err, HasSubstr(".png"));
  EXPECT_EQ(blind.out, "");
  write_here("swim/mav0/depth0/data.csv", "5000000,deep\n");
  const Ran bad = run_here("estimate swim");
  EXPECT_EQ(bad.status, 2);
  EXPECT_THAT(bad.err, HasSubstr("depth0/data.csv:1: field 2 is \"deep\""));
}

/// Replaces `from`, once, in a file of the test's folder.
void replace(const std::string& name, const std::string& from, const std::string& to) {
  std::string text = content_of(own_folder() / name);
  ASSERT_NE(text.find(from), std::string::npos) << from;
  write_here(name, text.replace(text.find(from), from.size(), to));
}

TEST(Estimate, WarnsOfASampleThatIsIgnored) {
  write_swim();
  const Ran intact = run_here("estimate swim --estimator primitive --json");
  EXPECT_EQ(nlohmann::json::parse(intact.out).at("warnings"), nlohmann::json::array());
  replace("swim/mav0/imu0/data.csv", "10000000,0,0,0", "10000000,0,0,1e300");
  const Ran ran = run_here("estimate swim --estimator primitive --json");
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("imu0/data.csv:2: warning: an angular rate of 1e+300 rad/s"));
  const auto json = nlohmann::json::parse(ran.out);
  ASSERT_EQ(json["warnings"].size(), 1U);
  EXPECT_EQ(json["warnings"][0]["code"], "IMU-RANGE");
  EXPECT_EQ(json["warnings"][0]["line"], 2);
  EXPECT_EQ(json["imu"]["refused"], 1);
  EXPECT_EQ(json["ate_m"], nlohmann::json::parse(intact.out).at("ate_m"));
}

/// The swim as another estimator could have written it: turned by 90 degrees, half a metre off at
/// its end, from the fifth second on.
std::string other_swim() {
  std::string text = "# t x y z qx qy qz qw\n";
  for (int k = 50; k <= 200; ++k) {
    const double along = 0.4 * 0.1 * k;
    text += fmt::format("{} {} {} -2 0 0 {} {}\n", 0.005 + 0.1 * k, -0.0025 * k, along,
                        std::sqrt(0.5), std::sqrt(0.5));
  }
  return text;
}

TEST(Estimate, ComparesWithAnotherEstimator) {
  write_swim();
  write_here("other.tum", other_swim());
  const std::string command = "estimate swim --estimator primitive --speed 0.4 --against ";
  const Ran ran = run_here(command + "other.tum --json");
  ASSERT_EQ(ran.status, 0) << ran.err;
  const auto against = nlohmann::json::parse(ran.out).at("against");
  EXPECT_EQ(against["file"], "other.tum");
  EXPECT_NEAR(against["begin_s"].get<double>(), 5.005, 1e-6);
  EXPECT_EQ(against["theirs"]["poses"], 151);
  // By the definition: 6 m of straight line, off by 6 % in the direction across.
  EXPECT_NEAR(against["theirs"]["drift_percent"].get<double>(), 6.25, 0.05);
  EXPECT_NEAR(against["theirs"]["distance_m"].get<double>(), 6.0, 0.01);
  EXPECT_TRUE(against["theirs"]["nees_position"].is_null());
  EXPECT_LT(against["ours"]["poses"].get<int>(), 305) << "only in the time of both";
  EXPECT_NEAR(against["ours"]["distance_m"].get<double>(), 6.0, 0.05);
  EXPECT_GT(against["ours"]["ate_m"].get<double>(), 0.0);

  const Ran text = run_here(command + "other.tum");
  EXPECT_THAT(text.out, HasSubstr("against other.tum, over the 15.0 s that both cover:"));
  EXPECT_THAT(text.out, ::testing::ContainsRegex("drift +[0-9.]+ % +6.2.. %"));

  const struct {
    std::string content;
    const char* words;
  } bad[] = {{"5.005 1 2 3\n", "bad.tum:1: 4 numbers; 8 are expected"},
             {"5005000000 0 0 0 0 0 0 1\n5005000001 0 0 0 0 0 0 1\n5005000002 0 0 0 0 0 0 1\n",
              "bad.tum: its poses are from 5005000000.000 s to 5005000002.000 s, the recording's "
              "images with ground truth from 0.005 s to 20.005 s"},
             {"1e18 0 0 0 0 0 0 1\n", "bad.tum:1: its time is not from 0 to 9e12; seconds"},
             {"# nothing\n", "bad.tum: 0 poses; at least 3"}};
  for (const auto& [content, words] : bad) {
    write_here("bad.tum", content);
    const Ran refused = run_here(command + "bad.tum");
    EXPECT_EQ(refused.status, 2);
    EXPECT_EQ(refused.out, "");
    EXPECT_THAT(refused.err, HasSubstr(words));
  }
  EXPECT_THAT(run_here(command + "nowhere.tum").err, HasSubstr("nowhere.tum: no such file"));
  fs::remove_all(own_folder() / "swim/mav0/state_groundtruth_estimate0");
  const Ran blind = run_here(command + "other.tum");
  EXPECT_EQ(blind.status, 2);
  EXPECT_THAT(blind.err, HasSubstr("other.tum: there is nothing to compare it with"));
}

/// The swim with a velocity, as dvl0, five times a second.
TEST(Estimate, UsesMeasuredVelocities) {
  write_swim();
  std::string velocity;
  for (long k = 0; k <= 100; ++k) velocity += fmt::format("{},0.4,0,0\n", 200'000'000 * (k + 1));
  const std::string command = "estimate swim --estimator primitive --speed 0.1 --json";
  const Ran expected = run_here(command);
  write_here("swim/mav0/dvl0/data.csv", velocity);
  const Ran measured = run_here(command);
  ASSERT_EQ(measured.status, 0) << measured.err;
  const auto json = nlohmann::json::parse(measured.out);
  EXPECT_EQ(json["velocity"]["samples"], 101);
  EXPECT_LT(json["ate_m"].get<double>(), 0.15);
  EXPECT_GT(nlohmann::json::parse(expected.out).at("ate_m").get<double>(), 1.0);
}

// A recording of EuRoC (V1_01_easy), with one thing wrong at a time.
TEST(Estimate, ReportsWhatIsWrongWithARealRecording) {
  const fs::path real = fs::path(DIVE_SHARED_DATA) / "recordings/euroc_v101_moving";
  if (!fs::exists(real)) GTEST_SKIP() << "no real recordings: " << real;
  DIVE_SKIP_UNDER_SANITIZERS("it estimates from 40 images, twice");
  const fs::path copy = own_folder() / "V1_01";
  fs::remove_all(copy);
  fs::create_directories(copy.parent_path());
  fs::copy(real, copy, fs::copy_options::recursive);
  const auto estimate = [] { return run_here("estimate V1_01 --init truth --no-depth --json"); };
  const Ran intact = estimate();
  ASSERT_EQ(intact.status, 0) << intact.err;
  const auto json = nlohmann::json::parse(intact.out);
  const double intact_m = json.at("ate_m").get<double>();
  EXPECT_EQ(json["restarts"], nlohmann::json::array());
  EXPECT_EQ(json["images"]["dark"], 0);
  EXPECT_EQ(json["imu"]["gaps"], 0);
  EXPECT_GT(json["features"]["used"].get<int>(), 100);
  EXPECT_EQ(json["health"]["trusted"], json["estimates"]);

  const std::string imu = content_of(real / "mav0/imu0/data.csv");
  const std::string stamp = "\n1403715286262142976,";
  ASSERT_NE(imu.find(stamp), std::string::npos);
  const std::size_t field = imu.find(stamp) + stamp.size();
  std::string wild = imu;
  wild.replace(field, wild.find(',', field) - field, "5000");
  write_here("V1_01/mav0/imu0/data.csv", wild);
  const Ran ran = estimate();
  ASSERT_EQ(ran.status, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("warning: an angular rate of 5000 rad/s"));
  EXPECT_LT(nlohmann::json::parse(ran.out).at("ate_m").get<double>(), 2.5 * intact_m);
  write_here("V1_01/mav0/imu0/data.csv", imu);

  const std::string yaml = content_of(real / "mav0/cam0/sensor.yaml");
  // Without IMU samples for a second and more, in the middle of it.
  std::istringstream lines(imu);
  std::string gap;
  int kept = 0;
  for (std::string line; std::getline(lines, line); ++kept) {
    if (kept < 150 || kept > 360) gap += line + "\n";
  }
  write_here("V1_01/mav0/imu0/data.csv", gap);
  const Ran torn = run_here("estimate V1_01 --init truth --no-depth");
  EXPECT_THAT(torn.out, HasSubstr("no IMU samples for 1."));
  EXPECT_THAT(torn.out, HasSubstr("the filter has not begun again; it waits for "));
  EXPECT_THAT(torn.out, ::testing::ContainsRegex("IMU +[0-9]+ samples, gaps 1, the longest of 1"));
  write_here("V1_01/mav0/imu0/data.csv", imu);

  for (const auto& [size, words] :
       {std::pair{"[640, 480]", "an image of 752 x 480 pixels; V1_01/mav0/cam0/sensor.yaml:16"},
        std::pair{"[32, 32]", "sensor.yaml:16: error: images of 32 x 32 pixels"}}) {
    replace("V1_01/mav0/cam0/sensor.yaml", "[752, 480]", size);
    const Ran refused = estimate();
    EXPECT_EQ(refused.status, 2);
    EXPECT_EQ(refused.out, "");
    EXPECT_THAT(refused.err, HasSubstr(words));
    write_here("V1_01/mav0/cam0/sensor.yaml", yaml);
  }
}

using estimation::testing::Wire;
using estimation::testing::Written;

/// The swim as messages.
std::vector<Written> swim_messages(Wire wire) {
  std::vector<Written> all;
  const std::string pixels(4, 'x');
  for (std::uint64_t k = 0; k <= 4000; ++k) {
    const std::uint64_t ns = 5'000'000 * (k + 1);
    all.push_back(estimation::testing::imu_message(wire, "/imu", ns, {0, 0, 0}, {0, 0, 9.81}));
    if (k % 10 != 0) continue;
    all.push_back(
        estimation::testing::image_message(wire, "/camera", ns, "mono8", 2, 2, 2, pixels));
    const double pressure = 101'325.0 + 2.0 * 1025.0 * 9.81;
    all.push_back(estimation::testing::pressure_message(wire, "/pressure", ns, pressure));
    const double x = 0.002 * static_cast<double>(k);
    all.push_back(estimation::testing::pose_message(wire, "/truth", ns,
                                                    {{x, 0, -2}, Eigen::Quaterniond::Identity()}));
  }
  return all;
}

TEST(Estimate, ReadsBagsAsItReadsFolders) {
  write_swim();
  const std::string of_estimator = " --estimator primitive --json";
  const Ran folder = run_here("estimate swim" + of_estimator);
  ASSERT_EQ(folder.status, 0) << folder.err;
  const auto expected = nlohmann::json::parse(folder.out);
  write_here("swim.bag", estimation::testing::ros1_bag(swim_messages(Wire::kRos1), "lz4", 500));
  write_here("ros2/swim_0.mcap", estimation::testing::mcap(swim_messages(Wire::kCdr), "zstd", 500));
  write_here("ros2/metadata.yaml", "rosbag2_bagfile_information: {}\n");
  const std::string calibration = " --calibration swim/mav0/cam0/sensor.yaml --topic truth=/truth";
  for (const char* const bag : {"swim.bag", "ros2/swim_0.mcap", "ros2"}) {
    const Ran ran = run_here(std::string("estimate ") + bag + calibration + of_estimator);
    ASSERT_EQ(ran.status, 0) << bag << ran.err;
    const auto json = nlohmann::json::parse(ran.out);
    EXPECT_EQ(json["frames"], expected["frames"]);
    EXPECT_NEAR(json["ate_m"].get<double>(), expected["ate_m"].get<double>(), 1e-6) << bag;
  }
  write_here("two/a.mcap", "");
  write_here("two/b.mcap", "");
  write_here("old/a.db3", "SQLite format 3, and no more");
  const std::pair<std::string, const char*> bad[] = {
      {"two" + calibration, "two: it has 2 bags; give one of them"},
      {"old" + calibration, "old/a.db3: sqlite3: "},
      {"swim.bag", "swim.bag: a bag has no calibration; give it with --calibration"},
      {"swim.bag --topic wing=/a" + calibration, "--topic wing=/a: SENSOR=NAME is expected"},
      {"swim.bag --topic imu=/camera" + calibration, "/camera is of type sensor_msgs/Image"},
      {"swim --preset euroc", "swim: --preset and --topic apply to a bag, and this is not one"},
      {"swim.bag --topic cam0=/camera --topic cam1=/camera" + calibration + calibration,
       "cam0 and cam1 are both /camera"},
      {"swim.bag --preset moon" + calibration, "moon"}};
  for (const auto& [arguments, words] : bad) {
    const Ran refused = run_here("estimate " + arguments);
    EXPECT_EQ(refused.status, 2) << arguments;
    EXPECT_EQ(refused.out, "");
    EXPECT_THAT(refused.err, HasSubstr(words));
  }
}

// TUM-VI's exported folders have their calibration beside mav0, by Kalibr.
TEST(Estimate, ReadsAFolderWithTheCalibrationThatIsGiven) {
  write_swim();
  const std::string command = "estimate swim --estimator primitive --json";
  const auto expected = nlohmann::json::parse(run_here(command).out).at("ate_m");
  for (const char* sensor : {"imu0", "cam0"}) {
    fs::remove(own_folder() / "swim/mav0" / sensor / "sensor.yaml");
  }
  const Ran none = run_here(command);
  EXPECT_EQ(none.status, 2);
  EXPECT_THAT(none.err, HasSubstr("give the calibration of cameras and IMU with --calibration"));
  write_here("swim/dso/camchain.yaml",
             "cam0:\n  T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]]\n"
             "  camera_model: pinhole\n  intrinsics: [190, 190, 254, 256]\n"
             "  distortion_model: equidistant\n  distortion_coeffs: [0, 0, 0, 0]\n"
             "  resolution: [512, 512]\n  rostopic: /cam0/image_raw\n");
  write_here("swim/dso/imu_config.yaml",
             "accelerometer_noise_density: 0.0028\naccelerometer_random_walk: 0.00086\n"
             "gyroscope_noise_density: 0.00016\ngyroscope_random_walk: 0.000022\n"
             "rostopic: /imu0\nupdate_rate: 200.0\n");
  const Ran beside = run_here(command);
  ASSERT_EQ(beside.status, 0) << beside.err;
  EXPECT_EQ(nlohmann::json::parse(beside.out).at("ate_m"), expected);
  EXPECT_THAT(beside.err, HasSubstr("calibration: swim/dso/camchain.yaml, swim/dso/imu_config"));
  fs::rename(own_folder() / "swim/dso", own_folder() / "kalibr");
  const Ran given = run_here(
      command + " --calibration kalibr/camchain.yaml --calibration kalibr/imu_config.yaml");
  ASSERT_EQ(given.status, 0) << given.err;
  EXPECT_EQ(nlohmann::json::parse(given.out).at("ate_m"), expected);
  fs::remove_all(own_folder() / "kalibr");
}

/// The rows of a data.csv without its comments, each split at commas.
std::vector<std::vector<std::string>> rows_of(const fs::path& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(content_of(csv));
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) {
      const std::size_t end = field.find_last_not_of(" \r");
      rows.back().push_back(field.substr(0, end + 1));
    }
  }
  return rows;
}

// The images too: the same real recording as a folder, and as a bag.
TEST(Estimate, EstimatesFromABagWhatItEstimatesFromTheFolder) {
  const fs::path real = fs::path(DIVE_SHARED_DATA) / "recordings/euroc_v101_moving/mav0";
  if (!fs::exists(real)) GTEST_SKIP() << "no real recordings: " << real;
  DIVE_SKIP_UNDER_SANITIZERS("it estimates from 40 images, twice");
  std::vector<Written> all;
  const auto number = [](const std::string& text) { return std::stod(text); };
  for (const auto& row : rows_of(real / "imu0/data.csv")) {
    all.push_back(estimation::testing::imu_message(
        Wire::kRos1, "/imu0", std::stoull(row[0]), {number(row[1]), number(row[2]), number(row[3])},
        {number(row[4]), number(row[5]), number(row[6])}));
  }
  for (const auto& row : rows_of(real / "cam0/data.csv")) {
    all.push_back(estimation::testing::compressed_message(Wire::kRos1, "/cam0/image_raw",
                                                          std::stoull(row[0]),
                                                          content_of(real / "cam0/data" / row[1])));
  }
  for (const auto& row : rows_of(real / "state_groundtruth_estimate0/data.csv")) {
    all.push_back(estimation::testing::pose_message(
        Wire::kRos1, "/truth", std::stoull(row[0]),
        {{number(row[1]), number(row[2]), number(row[3])},
         Eigen::Quaterniond(number(row[4]), number(row[5]), number(row[6]), number(row[7]))}));
  }
  write_here("V1_01.bag", estimation::testing::ros1_bag(all, "bz2", 30));
  const std::string how = " --init truth --no-depth --json";
  const Ran bag = run_here(
      fmt::format("estimate V1_01.bag --preset euroc --topic truth=/truth --calibration {}{}",
                  real.string(), how));
  ASSERT_EQ(bag.status, 0) << bag.err;
  EXPECT_THAT(bag.err, HasSubstr("preset euroc is untested"));
  const Ran folder = run_here("estimate " + real.string() + how);
  ASSERT_EQ(folder.status, 0) << folder.err;
  const double expected_m = nlohmann::json::parse(folder.out).at("ate_m").get<double>();
  EXPECT_NEAR(nlohmann::json::parse(bag.out).at("ate_m").get<double>(), expected_m, 0.01);
}

}  // namespace
}  // namespace dive::mission
