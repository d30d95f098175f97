#include "services/simulator/camera.h"

#include <algorithm>
#include <cmath>

#include "services/simulator/shading.h"
#include "services/simulator/streams.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kNoiseSamples = 1 << 16;

}  // namespace

std::string CameraConfig::Problem() const {
  if (!(rate >= 0.0 && rate <= 200.0)) return "rate is not within 0 to 200 Hz";
  if (!(noise >= 0.0 && noise <= 30.0)) return "noise is not within 0 to 30";
  if (!(exposure_variation >= 0.0 && exposure_variation < 1.0))
    return "exposure_variation is not within 0 to 1";
  if (!(exposure >= 0.0)) return "exposure is below 0 s";
  if (!(light >= 0.0)) return "light is below 0";
  return "";
}

Camera::Camera(const CameraConfig& config, const world::Rig& rig, const Vector3d& target_color,
               uint64_t seed)
    : config_(config),
      rig_(rig),
      target_color_(target_color.cast<float>()),
      random_(seed, kCameraStream) {
  for (std::size_t i = 0; i < kNoiseSamples; ++i)
    noise_.push_back(static_cast<int8_t>(
        std::lround(std::clamp(config_.noise * random_.Gaussian(), -127.0, 127.0))));
  const std::size_t row = static_cast<std::size_t>(3 * rig_.width_px);
  for (std::size_t i = 0; i < row; ++i) noise_.push_back(noise_[i]);  // a row runs over the end
  phase_ = random_.Uniform(0.0, 2.0 * kPi);
  for (int column = 0; column < rig_.width_px + 8; ++column)
    u_.push_back(static_cast<float>((column - rig_.center_u_px) / rig_.focal_px));
}

/// A slow wave and 1 % from frame to frame, as of an automatic exposure.
double Camera::NextBrightness(double t) {
  const double slow = config_.exposure_variation * std::sin(2.0 * kPi * t / 7.0 + phase_);
  return config_.light * (1.0 + slow + 0.01 * random_.Gaussian());
}

RayPacket Camera::Rays(int row, int column) const {
  RayPacket rays;
  const double v = (row - rig_.center_v_px) / rig_.focal_px;
  const Vector3f edge = (view_.R_WC.col(2) + v * view_.R_WC.col(1)).cast<float>();
  const Vector3f right = view_.R_WC.col(0).cast<float>(), origin = view_.p_WC.cast<float>();
  rays.count = std::min(8, rig_.width_px - column);
  for (int i = 0; i < 8; ++i) {
    const float u = u_[static_cast<std::size_t>(column + i)];
    rays.ox[i] = origin.x(), rays.oy[i] = origin.y(), rays.oz[i] = origin.z();
    rays.dx[i] = edge.x() + u * right.x();
    rays.dy[i] = edge.y() + u * right.y();
    rays.dz[i] = edge.z() + u * right.z();
  }
  return rays;
}

/// True where a packet's rays may meet something that moves.
bool Camera::MoversIn(int row, int column) const {
  return std::any_of(movers_.begin(), movers_.end(), [&](const PixelBox& box) {
    return box.left <= column + 7 && box.right >= column && box.top <= row && box.bottom >= row;
  });
}

void Camera::TraceTile(int row, int column, const Scene& scene, Image* image) {
  const int rows = std::min(TileBins::kRows, rig_.height_px - row);
  RayPacket rays[TileBins::kRows];
  HitPacket hits[TileBins::kRows];
  for (int k = 0; k < rows; ++k) {
    rays[k] = Rays(row + k, column);
    rays[k].movers = MoversIn(row + k, column);
  }
  scene.Trace(bins_.At(row, column), rays, rows, hits);
  for (int k = 0; k < rows; ++k) {
    const int pixel = (row + k) * rig_.width_px + column;
    LightPacket light;
    Shade(rays[k], hits[k], target_color_.data(), &light);
    Expose(light, brightness_, rays[k].count, &image->rgb[static_cast<std::size_t>(3 * pixel)]);
    if (rays[k].movers)
      visible_px_ +=
          std::count(hits[k].material, hits[k].material + rays[k].count, Material::kTarget);
  }
}

Image Camera::Render(const Vector3d& p_WB, const Eigen::Quaterniond& q_WB, double t,
                     const Scene& scene, const world::Solid& target) {
  view_ = {p_WB + q_WB * rig_.camera_position, q_WB.toRotationMatrix() * rig_.R_BC()};
  target_ = target;
  brightness_ = static_cast<float>(NextBrightness(t));
  Image image;
  image.width = rig_.width_px;
  image.height = rig_.height_px;
  image.exposure = config_.exposure;
  image.rgb.resize(static_cast<std::size_t>(3 * rig_.width_px * rig_.height_px));
  visible_px_ = 0;
  movers_.clear();
  for (const auto& solid : scene.MovingSolids()) {
    const Outline outline = OutlineOf(rig_, view_, solid);
    if (!outline.box.empty()) movers_.push_back(outline.box);
  }
  bins_.Project(rig_, view_, scene.StandingSolids());
  for (int row = 0; row < rig_.height_px; row += TileBins::kRows)
    for (int column = 0; column < rig_.width_px; column += TileBins::kColumns)
      TraceTile(row, column, scene, &image);
  alone_px_ = CountAlone(scene);
  AddNoise(&image);
  return image;
}

/// Pixels of the target with nothing in the way, looked for around its projection only.
long Camera::CountAlone(const Scene& scene) const {
  const PixelBox box = ProjectedBox(rig_, view_, target_);
  if (box.empty()) return 0;
  const int left = std::max(0, static_cast<int>(std::floor(box.left)));
  const int right = std::min(rig_.width_px - 1, static_cast<int>(std::ceil(box.right)));
  const int top = std::max(0, static_cast<int>(std::floor(box.top)));
  const int bottom = std::min(rig_.height_px - 1, static_cast<int>(std::ceil(box.bottom)));
  long count = 0;
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; column += 8) {
      const RayPacket rays = Rays(row, column);
      bool hit[8];
      scene.TraceTargetAlone(rays, hit);
      count += std::count(hit, hit + rays.count, true);
    }
  return count;
}

void Camera::AddNoise(Image* image) {
  if (config_.noise <= 0.0) return;
  const std::size_t stride = static_cast<std::size_t>(3 * image->width);
  for (int row = 0; row < image->height; ++row) {
    uint8_t* values = &image->rgb[static_cast<std::size_t>(row) * stride];
    const int8_t* noise = &noise_[random_.Next() % kNoiseSamples];
    for (std::size_t i = 0; i < stride; ++i) {
      const int value = values[i] + noise[i];
      values[i] = static_cast<uint8_t>(std::clamp(value, 0, 255));
    }
  }
}

TargetView Camera::View() const {
  TargetView view;
  const Vector3d p_C = view_.R_WC.transpose() * (target_.center - view_.p_WC);
  if (p_C.z() > 0.05) {
    view.px = rig_.Project(p_C);
    view.in_image = view.px.x() >= -0.5 && view.px.x() < rig_.width_px - 0.5 &&
                    view.px.y() >= -0.5 && view.px.y() < rig_.height_px - 0.5;
  }
  if (alone_px_ > 0)
    view.visible_share = static_cast<double>(visible_px_) / static_cast<double>(alone_px_);
  return view;
}

}  // namespace chase::simulator
