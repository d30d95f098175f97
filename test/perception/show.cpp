#include "show.h"

#include <algorithm>
#include <cmath>

#include "services/simulator/shading.h"

namespace chase::perception_stage {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using world::Solid;

const Vector3f kOrange(1.0f, 0.45f, 0.05f);
constexpr double kPaintNoise = 3.0;  // grey levels, as the camera's

/// A line of up to eight pixels as rays of the world.
simulator::RayPacket Rays(const world::Rig& rig, const Stage::Body& body, int row, int column,
                          int count) {
  const Eigen::Matrix3d R = body.q.toRotationMatrix() * rig.R_BC();
  const Vector3f o = (body.p + body.q * rig.camera_position).cast<float>();
  simulator::RayPacket rays;
  rays.count = count;
  for (int i = 0; i < 8; ++i) {
    const Vector3f d = (R * Vector3d((column + i - rig.center_u_px) / rig.focal_px,
                                     (row - rig.center_v_px) / rig.focal_px, 1.0))
                           .cast<float>();
    rays.ox[i] = o.x(), rays.oy[i] = o.y(), rays.oz[i] = o.z();
    rays.dx[i] = d.x(), rays.dy[i] = d.y(), rays.dz[i] = d.z();
  }
  return rays;
}

/// Pixels around a solid, not cut to the image; empty behind the camera.
cv::Rect Around(const world::Rig& rig, const Stage::Body& body, const Solid& solid) {
  const Eigen::Matrix3d R = body.q.toRotationMatrix() * rig.R_BC();
  const Vector3d p = R.transpose() * (solid.center - body.p - body.q * rig.camera_position);
  const double reach = solid.half_size.norm();
  if (p.z() < reach + 0.2) return {};
  const Eigen::Vector2d px = rig.Project(p);
  const int r = static_cast<int>(std::ceil(1.3 * reach / (p.z() - reach) * rig.focal_px)) + 2;
  return {static_cast<int>(px.x()) - r, static_cast<int>(px.y()) - r, 2 * r, 2 * r};
}

Stage::Body Disturbed(const Stage::Body& body, const Vector3d& p, const Vector3d& angle) {
  const double norm = angle.norm();
  if (norm < 1e-12) return {body.p + p, body.q};
  return {body.p + p, Eigen::Quaterniond(Eigen::AngleAxisd(norm, angle / norm)) * body.q};
}

simulator::CameraConfig CameraIn(double light) {
  simulator::CameraConfig config;
  config.light = light;
  return config;
}

}  // namespace

Show::Show(const Stage& stage, const world::Rig& rig)
    : stage_(stage),
      rig_(rig),
      actors_(stage.scenario()),
      scene_(stage.scenario()),
      camera_(CameraIn(stage.options().light), rig, stage.scenario().target.color,
              stage.options().seed),
      lidar_({}, rig, stage.options().seed),
      random_(stage.options().seed * 7919 + 5) {
  if (stage.options().absent) scene_.Show(false, false);
  const OdometryErrors& error = stage.options().errors;
  tilt_ = {error.tilt * normal_(random_), error.tilt * normal_(random_),
           error.heading * normal_(random_)};
}

simulator::TargetState Show::Target(double t) const {
  return actors_.Target(stage_.mission_start() + t);
}

std::optional<perception::Sweep> Show::Advance(double t) {
  std::vector<simulator::TimedPose> poses;
  const int steps = std::max(1, static_cast<int>(std::lround((t - last_t_) / 1e-3)));
  for (int i = 0; i <= steps; ++i) {
    const double at = last_t_ + (t - last_t_) * i / steps;
    const auto body = stage_.BodyAt(at);
    poses.push_back({at, body.p, body.q});
  }
  scene_.MoveTo(stage_.mission_start() + 0.5 * (last_t_ + t));
  lidar_.Advance(poses, scene_);
  last_t_ = t;
  const auto raw = lidar_.Take();
  if (!raw) return std::nullopt;
  perception::Sweep sweep;
  sweep.t = raw->start;
  for (size_t i = 0; i < raw->x.size(); ++i)
    sweep.points.emplace_back(raw->x[i], raw->y[i], raw->z[i]);
  sweep.times = raw->t;
  return sweep;
}

/// Of the unhidden target's pixels, the share within the image.
double Show::ShareInImage(const Stage::Body& body, const Solid& target) const {
  const cv::Rect around = Around(rig_, body, target), image(0, 0, rig_.width_px, rig_.height_px);
  long all = 0, in = 0;
  for (int row = around.y; row < around.br().y; ++row)
    for (int column = around.x; column < around.br().x; column += 8) {
      const int n = std::min(8, around.br().x - column);
      bool hit[8];
      scene_.TraceTargetAlone(Rays(rig_, body, row, column, n), hit);
      for (int i = 0; i < n; ++i) {
        all += hit[i];
        in += hit[i] && image.contains({column + i, row});
      }
    }
  return all > 0 ? static_cast<double>(in) / static_cast<double>(all) : 0.0;
}

/// Gives the pixels of a thing the target's colour under the light of the frame.
void Show::PaintOne(const Solid& solid, const Stage::Body& body, simulator::Image* image) {
  const cv::Rect box = Around(rig_, body, solid) & cv::Rect(0, 0, rig_.width_px, rig_.height_px);
  struct Spot {
    uint8_t* rgb;
    float lambert;
  };
  std::vector<Spot> spots;
  double seen = 0.0, expected = 0.0;  // to find the frame's exposure
  for (int row = box.y; row < box.br().y; ++row)
    for (int column = box.x; column < box.br().x; column += 8) {
      const auto rays = Rays(rig_, body, row, column, std::min(8, box.br().x - column));
      simulator::HitPacket hits;
      scene_.Trace(rays, &hits);
      simulator::LightPacket light;
      simulator::Shade(rays, hits, kOrange.data(), &light);
      for (int i = 0; i < rays.count; ++i) {
        if (hits.material[i] != simulator::Material::kPillar &&
            hits.material[i] != simulator::Material::kBox &&
            hits.material[i] != simulator::Material::kEllipsoid)
          continue;
        const Vector3f p = Vector3f(rays.ox[i], rays.oy[i], rays.oz[i]) +
                           hits.distance[i] * Vector3f(rays.dx[i], rays.dy[i], rays.dz[i]);
        if (world::SignedDistance(solid, p.cast<double>()) > 0.02) continue;
        const Vector3f n = Vector3f(hits.nx[i], hits.ny[i], hits.nz[i]).normalized();
        const float lambert = simulator::Lambert(n.x(), n.y(), n.z());
        uint8_t* rgb = &image->rgb[static_cast<size_t>(3 * (row * image->width + column + i))];
        spots.push_back({rgb, lambert});
        seen += rgb[1];
        expected += 255.0 * light.rgb[1][i];
      }
    }
  if (spots.empty()) return;
  const double exposure = seen / std::max(1.0, expected);
  for (const auto& spot : spots)
    for (int k = 0; k < 3; ++k)
      spot.rgb[k] = static_cast<uint8_t>(
          std::clamp(255.0 * exposure * spot.lambert * kOrange[k] + kPaintNoise * normal_(random_),
                     0.0, 255.0));
}

Shot Show::Image(double t) {
  const Stage::Body body = stage_.BodyAt(t);
  const auto target = Target(t);
  scene_.MoveTo(stage_.mission_start() + t);
  auto image = camera_.Render(body.p, body.q, t, scene_, target.cylinder);
  for (const auto& solid : stage_.orange()) PaintOne(solid, body, &image);
  Shot shot;
  shot.visible_share = stage_.options().absent
                           ? 0.0
                           : camera_.View().visible_share * ShareInImage(body, target.cylinder);
  shot.bgr.create(image.height, image.width, CV_8UC3);
  const Vector3d light = stage_.light();
  for (int i = 0; i < image.width * image.height; ++i)
    for (int k = 0; k < 3; ++k)
      shot.bgr.data[3 * i + 2 - k] = static_cast<uint8_t>(
          std::clamp(light[k] * image.rgb[static_cast<size_t>(3 * i + k)] + 0.5, 0.0, 255.0));
  return shot;
}

perception::PoseSample Show::Pose(double t) {
  const OdometryErrors& error = stage_.options().errors;
  const double decay = std::exp(-std::clamp(t - last_pose_t_, 0.0, 1e3) / error.correlation);
  const double fresh = std::sqrt(1.0 - decay * decay);
  for (int i = 0; i < 3; ++i)
    drift_[i] = decay * drift_[i] + fresh * error.position[i] * normal_(random_);
  last_pose_t_ = t;
  const double h = 2e-3;
  const auto at = stage_.BodyAt(t), before = stage_.BodyAt(t - h), after = stage_.BodyAt(t + h);
  const auto wrong = Disturbed(at, drift_, tilt_);
  perception::PoseSample pose;
  pose.t = t;
  pose.p_WB = wrong.p;
  pose.R_WB = wrong.q;
  pose.v_WB = (after.p - before.p) / (2.0 * h) +
              error.velocity * Vector3d(normal_(random_), normal_(random_), normal_(random_));
  const Eigen::AngleAxisd turn(before.q.conjugate() * after.q);
  pose.w_WB_B = turn.angle() * turn.axis() / (2.0 * h);
  pose.covariance.diagonal() << Vector3d::Constant(error.claimed_position * error.claimed_position),
      Vector3d::Constant(error.claimed_angle * error.claimed_angle);
  return pose;
}

}  // namespace chase::perception_stage
