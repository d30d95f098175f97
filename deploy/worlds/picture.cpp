#include "deploy/worlds/picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "deploy/worlds/worlds.h"

namespace chase::worlds {

using Eigen::Vector2d;
using world::Solid;

namespace {

constexpr int kWidth = 340, kHeight = 272, kTop = 26;  // px of a panel, of its heading
constexpr int kShift = 4;                              // fractional bits of OpenCV's coordinates
const cv::Scalar kInk(60, 60, 60), kCrown(205, 230, 205), kStand(140, 140, 140),
    kTrunk(60, 95, 120), kMover(200, 110, 30), kChaser(0, 0, 0);

/// The part of the world that a panel shows.
class Panel {
 public:
  explicit Panel(const world::Scenario& scenario);
  cv::Mat image() const { return image_; }

  void Draw(const Solid& solid, const cv::Scalar& color);
  void Line(const Vector2d& a, const Vector2d& b, const cv::Scalar& color, int width);
  void Dot(const Vector2d& p, double radius_px, const cv::Scalar& color, int width = -1);
  void ScaleBar();

 private:
  cv::Point At(const Vector2d& p) const;
  void Disc(const Vector2d& p, double radius, const cv::Scalar& color);

  cv::Mat image_;
  Vector2d center_;
  double px_per_m_ = 1.0;
};

Panel::Panel(const world::Scenario& scenario)
    : image_(kHeight, kWidth, CV_8UC3, cv::Scalar(252, 252, 252)) {
  Vector2d low = scenario.chaser.start.head<2>(), high = low;
  const auto cover = [&](const Vector2d& p, double reach) {
    low = low.cwiseMin((p.array() - reach).matrix());
    high = high.cwiseMax((p.array() + reach).matrix());
  };
  for (const auto& p : scenario.target.waypoints) cover(p, 1.0);
  for (const auto& s : world::StaticSolids(scenario)) {
    const Vector2d along = Polar(s.yaw, s.half_size.x());
    cover(s.center.head<2>() + along, s.half_size.y());
    cover(s.center.head<2>() - along, s.half_size.y());
  }
  center_ = 0.5 * (low + high);
  px_per_m_ = std::min((kWidth - 16) / (high - low).x(), (kHeight - kTop - 16) / (high - low).y());
  cv::putText(image_, scenario.name, {8, 18}, cv::FONT_HERSHEY_SIMPLEX, 0.5, kInk, 1, cv::LINE_AA);
}

cv::Point Panel::At(const Vector2d& p) const {
  const Vector2d px = px_per_m_ * (p - center_);
  const double u = 0.5 * kWidth + px.x(), v = 0.5 * (kHeight + kTop) - px.y();
  return {cvRound(u * (1 << kShift)), cvRound(v * (1 << kShift))};
}

void Panel::Disc(const Vector2d& p, double radius, const cv::Scalar& color) {
  Dot(p, std::max(1.0, px_per_m_ * radius), color);
}

void Panel::Dot(const Vector2d& p, double radius_px, const cv::Scalar& color, int width) {
  cv::circle(image_, At(p), cvRound(radius_px * (1 << kShift)), color, width, cv::LINE_AA, kShift);
}

void Panel::Line(const Vector2d& a, const Vector2d& b, const cv::Scalar& color, int width) {
  cv::line(image_, At(a), At(b), color, width, cv::LINE_AA, kShift);
}

void Panel::Draw(const Solid& solid, const cv::Scalar& color) {
  const Vector2d center = solid.center.head<2>();
  if (solid.kind != Solid::Kind::kBox)
    return Disc(center, solid.half_size.head<2>().maxCoeff(), color);
  const Vector2d along = Polar(solid.yaw, solid.half_size.x());
  const Vector2d across = Polar(solid.yaw + 0.5 * kPi, solid.half_size.y());
  const std::vector<cv::Point> corners = {At(center + along + across), At(center + along - across),
                                          At(center - along - across), At(center - along + across)};
  cv::fillConvexPoly(image_, corners, color, cv::LINE_AA, kShift);
  cv::polylines(image_, corners, true, color, 1, cv::LINE_AA, kShift);
}

void Panel::ScaleBar() {
  const int length = cvRound(5.0 * px_per_m_), right = kWidth - 10;
  cv::line(image_, {right - length, 20}, {right, 20}, kInk, 2);
  cv::putText(image_, "5 m", {right - 28, 14}, cv::FONT_HERSHEY_SIMPLEX, 0.38, kInk, 1,
              cv::LINE_AA);
}

bool IsCrown(const Solid& solid) {
  return solid.kind == Solid::Kind::kEllipsoid && solid.center.z() - solid.half_size.z() > 2.5;
}

void DrawStatics(const world::Scenario& scenario, Panel* panel) {
  const auto solids = world::StaticSolids(scenario);
  for (const Solid& solid : solids)
    if (IsCrown(solid)) panel->Draw(solid, kCrown);
  const bool trees = scenario.world.forest.count > 0 || !scenario.world.trees.empty();
  for (const Solid& solid : solids)
    if (!IsCrown(solid))
      panel->Draw(solid, trees && solid.kind == Solid::Kind::kCylinder ? kTrunk : kStand);
}

void DrawMovers(const world::Scenario& scenario, Panel* panel) {
  for (const auto& mover : scenario.movers) {
    for (std::size_t i = 1; i < mover.waypoints.size(); ++i)
      panel->Line(mover.waypoints[i - 1].head<2>(), mover.waypoints[i].head<2>(), kMover, 1);
    panel->Draw(world::MoverAt(mover, 0.0).solid, kMover);
  }
}

void DrawChase(const world::Scenario& scenario, Panel* panel) {
  const Eigen::Vector3d bgr = 235.0 * scenario.target.color.reverse();
  const cv::Scalar color(bgr[0], bgr[1], bgr[2]);
  const auto path = world::TargetMotion(scenario);
  for (double t = 0.0; t < std::min(path.Duration(), scenario.duration_s); t += 0.1)
    panel->Line(path.Position(t), path.Position(t + 0.1), color, 2);
  panel->Dot(path.Position(0.0), 5.0, color);
  for (const auto& stop : scenario.target.stops)
    panel->Dot(scenario.target.waypoints[static_cast<std::size_t>(stop.waypoint)], 3.5, color, 1);
  const Vector2d start = scenario.chaser.start.head<2>();
  panel->Dot(start, 4.0, kChaser, 2);
  panel->Line(start, start + Polar(scenario.chaser.yaw_deg * kPi / 180.0, 1.5), kChaser, 2);
}

cv::Mat Picture(const world::Scenario& scenario) {
  Panel panel(scenario);
  DrawStatics(scenario, &panel);
  DrawMovers(scenario, &panel);
  DrawChase(scenario, &panel);
  panel.ScaleBar();
  cv::Mat image = panel.image();
  cv::rectangle(image, {0, 0, kWidth, kHeight}, cv::Scalar(215, 215, 215));
  return image;
}

void Save(const cv::Mat& image, const std::string& file) {
  bool written = false;
  try {
    written = cv::imwrite(file, image, {cv::IMWRITE_PNG_COMPRESSION, 9});
  } catch (const cv::Exception&) {  // no such format
  }
  if (!written) throw std::runtime_error(file + ": cannot be written; name a .png in a folder");
}

}  // namespace

void SavePicture(const world::Scenario& scenario, const std::string& file) {
  Save(Picture(scenario), file);
}

void SaveMontage(uint64_t seed, const Options& options, const std::string& file) {
  constexpr int kColumns = 4;
  std::vector<cv::Mat> rows;
  for (std::size_t i = 0; i < Kinds().size(); i += kColumns) {
    std::vector<cv::Mat> row;
    for (std::size_t k = i; k < std::min(i + kColumns, Kinds().size()); ++k)
      row.push_back(Picture(MakeWorld(Kinds()[k].name, seed, options)));
    rows.emplace_back();
    cv::hconcat(row, rows.back());
  }
  cv::Mat all;
  cv::vconcat(rows, all);
  Save(all, file);
}

}  // namespace chase::worlds
