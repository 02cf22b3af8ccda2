#include "mission/drawing/svg.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/xml.h"

namespace dive::mission {
namespace {

using planning::Box;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const double kNan = std::numeric_limits<double>::quiet_NaN();

XmlElement parsed(const std::string& svg) {
  Diagnostics diagnostics;
  const std::optional<XmlDocument> document =
      parse_xml({"picture.svg", svg}, {.max_bytes = 1U << 24U}, diagnostics);
  for (const Diagnostic& diagnostic : diagnostics.list())
    ADD_FAILURE() << render(diagnostic, false);
  if (!document) throw std::runtime_error("not XML");
  return document->root;
}

void visit(const XmlElement& element, const std::function<void(const XmlElement&)>& action) {
  action(element);
  for (const XmlElement& child : element.children) visit(child, action);
}

std::string attribute(const XmlElement& element, const char* name) {
  const XmlAttribute* found = element.attribute(name);
  return found == nullptr ? std::string() : found->value;
}

std::vector<const XmlElement*> all_of(const XmlElement& root, std::string_view name) {
  std::vector<const XmlElement*> found;
  visit(root, [&](const XmlElement& element) {
    if (element.name == name) found.push_back(&element);
  });
  return found;
}

std::vector<std::string> texts(const XmlElement& root) {
  std::vector<std::string> found;
  for (const XmlElement* text : all_of(root, "text")) found.push_back(text->text);
  return found;
}

// Every number in every numeric attribute is finite and on the sheet or not absurdly far from it.
// parse_number rejects "nan" and "inf".
void expect_drawable(const std::string& svg) {
  const XmlElement root = parsed(svg);
  EXPECT_EQ(root.name, "svg");
  EXPECT_EQ(root.namespace_uri, "http://www.w3.org/2000/svg");
  const auto check = [](std::string_view numbers) {
    while (!numbers.empty()) {
      const std::size_t end = std::min(numbers.find_first_of(" ,"), numbers.size());
      const std::optional<double> number = parse_number(numbers.substr(0, end));
      ASSERT_TRUE(number) << numbers.substr(0, end);
      EXPECT_LT(std::abs(*number), 1e9);
      numbers.remove_prefix(std::min(end + 1, numbers.size()));
    }
  };
  visit(root, [&](const XmlElement& element) {
    for (const char* name : {"x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "width", "height",
                             "points", "viewBox", "font-size"}) {
      check(attribute(element, name));
    }
    EXPECT_THAT((std::vector<std::string>{"svg", "title", "g", "rect", "line", "circle", "polygon",
                                          "polyline", "text", "clipPath"}),
                Contains(element.name));
  });
}

// Reads a view back as a viewer does: by the numbers at its axes. Two numbers below the view give
// the horizontal scale and origin, two beside it the vertical ones.
struct Ruler {
  double origin = 0.0;
  double pixels_per_metre = 0.0;
};

struct View {
  Ruler u;
  Ruler v;
};

Ruler ruler_from(const std::vector<const XmlElement*>& numbers, const char* coordinate) {
  const XmlElement& first = *numbers.front();
  const XmlElement& last = *numbers.back();
  const double a = *parse_number(first.text);
  const double b = *parse_number(last.text);
  const double at_a = *parse_number(attribute(first, coordinate));
  const double at_b = *parse_number(attribute(last, coordinate));
  Ruler ruler;
  ruler.pixels_per_metre = (at_b - at_a) / (b - a);
  ruler.origin = at_a - a * ruler.pixels_per_metre;
  return ruler;
}

// The view with this title of the vertical axis: axis numbers are the only numeric texts.
View view_of(const XmlElement& root, const std::string& v_title) {
  std::vector<const XmlElement*> across;
  std::vector<const XmlElement*> upwards;
  for (const XmlElement* text : all_of(root, "text")) {
    if (text->text == v_title) break;
    if (text->text == "x, east (m)") continue;
    if (attribute(*text, "font-size") == "15.0") {  // the heading of a panel
      across.clear();
      upwards.clear();
    }
    if (!parse_number(text->text) || attribute(*text, "fill") != "#555555") continue;
    (attribute(*text, "text-anchor") == "middle" ? across : upwards).push_back(text);
  }
  if (across.size() < 2 || upwards.size() < 2) throw std::runtime_error("no axes: " + v_title);
  View view{ruler_from(across, "x"), ruler_from(upwards, "y")};
  view.v.origin -= 4.0;  // a number's baseline lies 4 px below its middle
  return view;
}

std::vector<Eigen::Vector2d> corners_of(const XmlElement& polygon, const View& view) {
  std::vector<Eigen::Vector2d> corners;
  std::string points = attribute(polygon, "points");
  for (char& c : points) c = c == ',' ? ' ' : c;
  std::size_t at = 0;
  while (at < points.size()) {
    std::size_t used = 0;
    const double x = std::stod(points.substr(at), &used);
    at += used;
    const double y = std::stod(points.substr(at), &used);
    at += used;
    corners.emplace_back((x - view.u.origin) / view.u.pixels_per_metre,
                         (y - view.v.origin) / view.v.pixels_per_metre);
  }
  return corners;
}

Eigen::AlignedBox2d bounds_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : points) box.extend(p);
  return box;
}

Pose at(double x, double y, double z) { return {{x, y, z}, Eigen::Quaterniond::Identity()}; }

// An overhead above the path, a wall beside it, a rotated block, a seabed.
struct Scene {
  planning::World world;
  planning::RobotHull hull;
  DiveDrawing drawing;

  Scene() {
    world.obstacles = {
        {"wall", Box{{4.0, 0.5, 3.0}}, at(3.0, 3.0, -4.0)},
        {"roof", Box{{4.0, 4.0, 0.2}}, at(3.0, 1.0, -2.0)},
        {"block", Box{{1.0, 1.0, 1.0}}, {{7.0, 3.0, -4.0}, from_rpy(0, 0, deg_to_rad(45))}},
        {"seabed", Box{{500.0, 500.0, 2.0}}, at(0.0, 0.0, -8.0)},
        {"buoy", planning::Sphere{0.4}, at(0.0, 3.0, -1.0)}};
    for (const double x : {-0.4, 0.4}) {
      for (const double y : {-0.2, 0.2}) {
        for (const double z : {-0.1, 0.1}) {
          if (hull.parts.empty()) hull.parts.push_back({"box", {}});
          hull.parts[0].vertices.emplace_back(x, y, z);
        }
      }
    }
    drawing.title = "dive";
    drawing.world = &world;
    drawing.hull = &hull;
    drawing.clearance_required_m = 1.0;
    drawing.legs = {{"east", {at(0, 0, -4), at(4, 0, -4), at(8, 0, -4)}, 1.25}};
    drawing.goals = {{"far <end>", {8, 0, -4}}};
  }
};

// Number of polygons outside of sweep groups with these bounds in the view.
int polygons_at(const XmlElement& root, const View& view, const Eigen::AlignedBox2d& expected,
                std::string_view style) {
  int count = 0;
  for (const XmlElement* polygon : all_of(root, "polygon")) {
    const Eigen::AlignedBox2d box = bounds_of(corners_of(*polygon, view));
    const bool dashed = polygon->attribute("stroke-dasharray") != nullptr;
    const bool translucent = polygon->attribute("fill-opacity") != nullptr;
    const std::string_view kind = dashed ? "dashed" : translucent ? "translucent" : "solid";
    if (box.isApprox(expected, 0.0) || ((box.min() - expected.min()).norm() < 0.02 &&
                                        (box.max() - expected.max()).norm() < 0.02)) {
      count += kind == style ? 1 : 0;
    }
  }
  return count;
}

Eigen::AlignedBox2d box2(double u0, double v0, double u1, double v1) {
  return {Eigen::Vector2d(u0, v0), Eigen::Vector2d(u1, v1)};
}

TEST(Svg, DrawsBothViewsToTheScaleOfTheirAxes) {
  const Scene scene;
  const XmlElement root = parsed(render_svg(scene.drawing));
  const View top = view_of(root, "y, north (m)");
  const View side = view_of(root, "z, up (m)");
  // One scale for all three axes, y and z upwards, x the same in both views.
  EXPECT_NEAR(top.u.pixels_per_metre, -top.v.pixels_per_metre, 0.05);
  EXPECT_NEAR(top.u.pixels_per_metre, side.u.pixels_per_metre, 0.05);
  EXPECT_NEAR(side.u.pixels_per_metre, -side.v.pixels_per_metre, 0.05);
  EXPECT_NEAR(top.u.origin, side.u.origin, 0.05);
  EXPECT_GT(top.u.pixels_per_metre, 40.0);

  EXPECT_EQ(polygons_at(root, top, box2(1.0, 2.75, 5.0, 3.25), "solid"), 1) << "wall from above";
  EXPECT_EQ(polygons_at(root, top, box2(1.0, -1.0, 5.0, 3.0), "dashed"), 1)
      << "overhead from above";
  EXPECT_EQ(polygons_at(root, top, box2(-250, -250, 250, 250), "translucent"), 1) << "seabed";
  const double half = std::sqrt(0.5);
  EXPECT_EQ(polygons_at(root, top, box2(7 - half, 3 - half, 7 + half, 3 + half), "solid"), 1)
      << "the block on its corner";
  EXPECT_EQ(polygons_at(root, side, box2(1.0, -5.5, 5.0, -2.5), "translucent"), 1)
      << "the wall behind the path, from the south";
  EXPECT_EQ(polygons_at(root, side, box2(1.0, -2.1, 5.0, -1.9), "solid"), 1) << "overhead edge-on";
}

// The crosses of a collision: two red lines with a common midpoint.
std::vector<Eigen::Vector2d> crosses_of(const XmlElement& root) {
  std::vector<Eigen::Vector2d> middles;
  for (const XmlElement* line : all_of(root, "line")) {
    if (attribute(*line, "stroke") != "#b3261e" || line->attribute("stroke-dasharray") != nullptr) {
      continue;
    }
    const auto number = [&](const char* name) { return std::stod(attribute(*line, name)); };
    middles.emplace_back(0.5 * (number("x1") + number("x2")), 0.5 * (number("y1") + number("y2")));
  }
  std::vector<Eigen::Vector2d> crosses;
  for (std::size_t i = 1; i < middles.size(); ++i) {
    if ((middles[i] - middles[i - 1]).norm() < 0.01) crosses.push_back(middles[i]);
  }
  return crosses;
}

TEST(Svg, MarksWhereAndWhenSomethingWasTouched) {
  Scene scene;
  scene.drawing.swum = {{0, 0, -4}, {4, 2.6, -4}, {8, 0, -4}};
  scene.drawing.errors = {{0.0, 0.0, true}, {10.0, 0.5, false}};
  EXPECT_TRUE(crosses_of(parsed(render_svg(scene.drawing))).empty());
  scene.drawing.collisions = {{6.5, {4, 2.6, -4}, "wall <north>", std::nullopt},
                              {20.0, {kNan, 0, 0}, "nowhere", std::nullopt}};
  const std::string svg = render_svg(scene.drawing);
  expect_drawable(svg);
  const XmlElement root = parsed(svg);
  EXPECT_THAT(texts(root), Contains("wall <north>, 6.5 s").Times(4))
      << "in both views, each with its halo";
  EXPECT_THAT(texts(root), Contains("collision: obstacle, time"));
  const View top = view_of(root, "y, north (m)");
  const View side = view_of(root, "z, up (m)");
  const View time = view_of(root, "error (m)");
  const std::vector<Eigen::Vector2d> crosses = crosses_of(root);
  ASSERT_EQ(crosses.size(), 5U) << "top, side, twice in the diagram, legend";
  const auto u_of = [](const View& view, const Eigen::Vector2d& p) {
    return (p.x() - view.u.origin) / view.u.pixels_per_metre;
  };
  EXPECT_NEAR(u_of(top, crosses[0]), 4.0, 0.02);
  EXPECT_NEAR((crosses[0].y() - top.v.origin) / top.v.pixels_per_metre, 2.6, 0.02);
  EXPECT_NEAR(u_of(side, crosses[1]), 4.0, 0.02);
  EXPECT_NEAR((crosses[1].y() - side.v.origin) / side.v.pixels_per_metre, -4.0, 0.02);
  EXPECT_NEAR(u_of(time, crosses[2]), 6.5, 0.05);
  EXPECT_NEAR(u_of(time, crosses[3]), 20.0, 0.05);
}

TEST(Svg, SweepsTheHullAlongTheLegs) {
  const Scene scene;
  const XmlElement root = parsed(render_svg(scene.drawing));
  const View top = view_of(root, "y, north (m)");
  EXPECT_EQ(polygons_at(root, top, box2(-0.4, -0.2, 4.4, 0.2), "solid"), 1);
  EXPECT_EQ(polygons_at(root, top, box2(3.6, -0.2, 8.4, 0.2), "solid"), 1);
  // A turn on the spot reaches as far as the hull's half-diagonal.
  Scene turning;
  turning.drawing.legs[0].waypoints = {{{2, 0, -4}, from_rpy(0, 0, 0)},
                                       {{2, 0, -4}, from_rpy(0, 0, deg_to_rad(179))}};
  const XmlElement turned = parsed(render_svg(turning.drawing));
  const View view = view_of(turned, "y, north (m)");
  Eigen::AlignedBox2d reach;
  for (const XmlElement* group : all_of(turned, "g")) {
    if (group->attribute("opacity") == nullptr) continue;
    for (const XmlElement& polygon : group->children) {
      reach.extend(bounds_of(corners_of(polygon, view)));
    }
    break;  // the first is the top view's
  }
  EXPECT_NEAR(reach.max().y(), std::hypot(0.4, 0.2), 0.01);
  EXPECT_NEAR(reach.min().y(), -std::hypot(0.4, 0.2), 0.01);
}

TEST(Svg, NamesLegsGoalsAndClearances) {
  Scene scene;
  scene.drawing.legs.push_back({"too <near>", {at(8, 0, -4), at(8, 2, -4)}, 0.7});
  scene.drawing.title = "a & b";
  const std::string svg = render_svg(scene.drawing);
  expect_drawable(svg);
  const std::vector<std::string> words = texts(parsed(svg));
  for (const char* expected : {"a & b", "east", "8.00 m", "1.25 m", "too <near>", "0.70 m",
                               "required: 1.00 m", "far <end>", "start", "surface", "1", "2"}) {
    EXPECT_THAT(words, Contains(expected));
  }
  // A goal at the start of the dive gives the start its name.
  scene.drawing.goals.emplace_back("dock", Eigen::Vector3d(0, 0, -4));
  EXPECT_THAT(texts(parsed(render_svg(scene.drawing))), Not(Contains("start")));
  EXPECT_THAT(svg, Not(HasSubstr("<script")));
  EXPECT_THAT(svg, Not(HasSubstr("href")));
}

// 5 m from the start, in both views and in the legend.
TEST(Svg, MarksTheNarrowPartOfAReducedPath) {
  Scene scene;
  scene.drawing.legs[0].narrow_m = 5.0;
  const std::string svg = render_svg(scene.drawing);
  expect_drawable(svg);
  const XmlElement root = parsed(svg);
  for (const char* title : {"y, north (m)", "z, up (m)"}) {
    const View view = view_of(root, title);
    int marked = 0;
    for (const XmlElement* line : all_of(root, "polyline")) {
      if (attribute(*line, "stroke-width") != "5") continue;
      const Eigen::AlignedBox2d box = bounds_of(corners_of(*line, view));
      marked += std::abs(box.min().x()) < 0.02 && std::abs(box.max().x() - 5.0) < 0.02 ? 1 : 0;
    }
    EXPECT_EQ(marked, 2) << "one in each view, and x is the same in both";
  }
  EXPECT_THAT(texts(root), Contains("less than the clearance"));
  EXPECT_THAT(texts(parsed(render_svg(Scene().drawing))), Not(Contains("less than the clearance")));
}

TEST(Svg, PlotsTheErrorOverTime) {
  Scene scene;
  scene.drawing.swum = {{0, 0, -4}, {8, 0.1, -4}};
  scene.drawing.errors = {{0.0, 0.0, true}, {10.0, 0.5, false}, {20.0, 0.25, true}};
  const XmlElement root = parsed(render_svg(scene.drawing));
  const View diagram = view_of(root, "error (m)");
  bool plotted = false;
  for (const XmlElement* line : all_of(root, "polyline")) {
    const std::vector<Eigen::Vector2d> points = corners_of(*line, diagram);
    plotted = plotted || (points.size() == 3 && (points[0] - Eigen::Vector2d(0, 0)).norm() < 0.02 &&
                          (points[1] - Eigen::Vector2d(10, 0.5)).norm() < 0.02 &&
                          (points[2] - Eigen::Vector2d(20, 0.25)).norm() < 0.02);
  }
  EXPECT_TRUE(plotted);
  EXPECT_THAT(texts(root), Contains("D_min = 1.00 m"));
  int ticks = 0;
  bool required = false;
  for (const XmlElement* line : all_of(root, "line")) {
    const double x1 = *parse_number(attribute(*line, "x1"));
    const double x2 = *parse_number(attribute(*line, "x2"));
    const double t = (x1 - diagram.u.origin) / diagram.u.pixels_per_metre;
    const double e =
        (*parse_number(attribute(*line, "y1")) - diagram.v.origin) / diagram.v.pixels_per_metre;
    const bool is_tick = attribute(*line, "stroke") == "#0072b2" && std::abs(e) < 0.01 && x1 == x2;
    ticks += is_tick && (std::abs(t) < 0.05 || std::abs(t - 20.0) < 0.05) ? 1 : 0;
    required = required || (std::abs(e - 1.0) < 0.01 && x2 - x1 > 900.0 &&
                            line->attribute("stroke-dasharray") != nullptr);
  }
  EXPECT_EQ(ticks, 2);
  EXPECT_TRUE(required);
}

TEST(Svg, DrawsWhateverItIsGiven) {
  expect_drawable(render_svg({}));
  Scene map_only;
  map_only.drawing.legs.clear();
  map_only.drawing.goals.clear();
  expect_drawable(render_svg(map_only.drawing));

  Scene odd;
  odd.world.obstacles.push_back(
      {"bed", planning::HalfSpace{Eigen::Vector3d::UnitZ()}, at(0, 0, -6)});
  odd.world.obstacles.push_back({"nan", Box{{1, 1, 1}}, at(kNan, 0, 0)});
  odd.world.obstacles.push_back({"huge", planning::Sphere{1e300}, Pose{}});
  odd.world.obstacles.push_back({"pole", planning::Cylinder{0.2, 3.0}, at(5, -1, -4)});
  odd.world.obstacles.push_back({"pipe", planning::Capsule{0.2, 3.0}, at(5, -2, -4)});
  odd.world.obstacles.push_back({"egg", planning::Ellipsoid{{0.2, 0.3, 1.0}}, at(5, -3, -4)});
  odd.drawing.title = "\xff\xc3\x28 \x01 \xe2\x82 ]]> \"quoted\"";
  odd.drawing.legs.push_back({"", {}, kNan});
  odd.drawing.legs.push_back({"one point", {Pose{}}, -1.0});
  odd.drawing.legs.push_back({"nan", {Pose{}, at(kNan, 0, 0), at(1, 1, -1)}, 1.0});
  odd.drawing.legs.push_back({"far", {Pose{}, at(1e300, 0, 0)}, 1.0});
  odd.drawing.goals.push_back({"nowhere", {kNan, kNan, kNan}});
  odd.drawing.goals.push_back({std::string(500, 'x'), {0, 0, 0}});
  odd.drawing.swum = {{kNan, 0, 0}, {0, 0, -1}, {1, kNan, 0}, {1, 0, -1}, {1e200, 0, 0}};
  odd.drawing.estimated = {{kNan, kNan, kNan}};
  odd.drawing.errors = {{kNan, 1.0, true}, {1.0, kNan, true}, {1.0, 1e-3, false}};
  expect_drawable(render_svg(odd.drawing));
}

TEST(Svg, KeepsALongDiveReadable) {
  Scene scene;
  for (int i = 0; i < 60; ++i) {
    scene.drawing.legs.push_back({fmt::format("leg {}", i), scene.drawing.legs[0].waypoints, 1.1});
  }
  for (int i = 0; i < 60'000; ++i) {
    const double t = 0.02 * i;
    scene.drawing.swum.emplace_back(4 + 4 * std::sin(t * 0.01), 0.3 * std::sin(t * 0.03), -4.0);
    scene.drawing.errors.push_back({t, 0.1 * std::abs(std::sin(t)), i % 500 == 0});
  }
  const std::string svg = render_svg(scene.drawing);
  expect_drawable(svg);
  EXPECT_LT(svg.size(), 3'000'000U);
  EXPECT_THAT(texts(parsed(svg)), Contains("and 37 more"));
}

}  // namespace
}  // namespace dive::mission
