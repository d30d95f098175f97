#include "perception_world.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <deque>
#include <utility>

namespace chase::perception_test {

namespace {

using Eigen::Vector3d;

constexpr int kSuper = 3;  // samples a pixel and axis near objects
constexpr double kHallHalf = 9.0, kHallHeight = 3.0;

/// Smallest positive distance along o + s d to the upright capped cylinder, or -1.
double HitCylinder(const Vector3d& c, double r, double half, const Vector3d& o, const Vector3d& d) {
  const Vector3d q = o - c;
  const double a = d.x() * d.x() + d.y() * d.y(), b = q.x() * d.x() + q.y() * d.y();
  const double e = q.x() * q.x() + q.y() * q.y() - r * r, disc = b * b - a * e;
  double best = -1.0;
  if (a > 1e-12 && disc >= 0.0) {
    const double s = (-b - std::sqrt(disc)) / a;
    if (s > 0.0 && std::abs(q.z() + s * d.z()) <= half) best = s;
  }
  for (const double z : {-half, half}) {
    if (std::abs(d.z()) < 1e-12) continue;
    const double s = (z - q.z()) / d.z();
    const double x = q.x() + s * d.x(), y = q.y() + s * d.y();
    if (s > 0.0 && x * x + y * y <= r * r && (best < 0.0 || s < best)) best = s;
  }
  return best;
}

double HitBox(const Vector3d& c, const Vector3d& half, const Vector3d& o, const Vector3d& d) {
  double low = 0.0, high = 1e18;
  for (int i = 0; i < 3; ++i) {
    const double inverse = 1.0 / (d[i] == 0.0 ? 1e-15 : d[i]);
    double a = (c[i] - half[i] - o[i]) * inverse, b = (c[i] + half[i] - o[i]) * inverse;
    if (a > b) std::swap(a, b);
    low = std::max(low, a);
    high = std::min(high, b);
  }
  return low > 0.0 && low <= high ? low : -1.0;
}

double HitSphere(const Vector3d& c, double r, const Vector3d& o, const Vector3d& d) {
  const Vector3d q = o - c;
  const double a = d.squaredNorm(), b = q.dot(d), disc = b * b - a * (q.squaredNorm() - r * r);
  return disc < 0.0 ? -1.0 : (-b - std::sqrt(disc)) / a;
}

double HitThing(const Thing& thing, const Vector3d& o, const Vector3d& d) {
  if (thing.kind == Thing::Kind::kCylinder)
    return HitCylinder(thing.center, thing.half.x(), thing.half.z(), o, d);
  if (thing.kind == Thing::Kind::kBox) return HitBox(thing.center, thing.half, o, d);
  return HitSphere(thing.center, thing.half.x(), o, d);
}

/// Speckle fixed to the place.
double Speckle(double x, double y) {
  const auto i = static_cast<int64_t>(std::floor(x * 5.0)),
             j = static_cast<int64_t>(std::floor(y * 5.0));
  const auto h = static_cast<uint64_t>(i * 73856093 ^ j * 19349663) * 2654435761u;
  return static_cast<double>((h >> 8) & 255u) / 255.0;
}

/// Brightness of a face, from the side that it is seen at.
double Shade(const Vector3d& c, const Vector3d& p) {
  const Vector3d out = (p - c).normalized();
  return 0.62 + 0.38 * std::max(0.0, out.dot(Vector3d(0.4, 0.3, 0.86)));
}

Thing Carrier(const Vector3d& target) {
  return {Thing::Kind::kBox, {target.x(), target.y(), 0.15}, {0.25, 0.2, 0.15}, {0.25, 0.27, 0.3}};
}

/// Body looking at `aim`, with a small roll and pitch of its own.
Body Looking(const Vector3d& p, const Vector3d& aim, double pitch, double roll) {
  const double yaw = std::atan2(aim.y() - p.y(), aim.x() - p.x());
  return {p, Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                 Eigen::AngleAxisd(pitch, Vector3d::UnitY()) *
                 Eigen::AngleAxisd(roll, Vector3d::UnitX())};
}

/// Pillars that keep clear of both paths.
void AddPillars(World* w, int count, double span, double r0, double r1, const Vector3d& rgb,
                double until, std::mt19937* random) {
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const size_t wanted = w->things.size() + static_cast<size_t>(count);
  for (int tries = 0; tries < 3000 && w->things.size() < wanted; ++tries) {
    const double r = r0 + (r1 - r0) * u(*random), around = until * u(*random);
    const Vector3d c = w->target(around) + span * Vector3d(u(*random) - 0.5, u(*random) - 0.5, 0.0);
    bool clear = true;
    for (double t = 0.0; clear && t < until; t += 0.1)
      clear = (w->target(t) - c).head<2>().norm() > r + 0.5 &&
              (w->body(t).p - c).head<2>().norm() > r + 0.5;
    if (clear) w->things.push_back({Thing::Kind::kCylinder, {c.x(), c.y(), 1.5}, {r, r, 1.5}, rgb});
  }
}

}  // namespace

Renderer::Hit Renderer::Cast(const Vector3d& o, const Vector3d& d, double t, bool things) const {
  Hit hit;
  const auto take = [&](double s, int index, const Vector3d& rgb) {
    if (s > 0.0 && s < hit.distance) hit = {s, index, rgb};
  };
  const Vector3d target = world_.target(t);
  const double s = HitCylinder(target, world_.target_radius, 0.5 * world_.target_height, o, d);
  if (s > 0.0) take(s, -1, world_.target_rgb * Shade(target, o + s * d));
  if (!things) return hit;
  const Thing carrier = Carrier(target);
  take(HitThing(carrier, o, d), 1000, carrier.rgb);
  for (size_t i = 0; i < world_.things.size(); ++i) {
    const double si = HitThing(world_.things[i], o, d);
    if (si > 0.0 && si < hit.distance)
      take(si, static_cast<int>(i),
           world_.things[i].rgb * Shade(world_.things[i].center, o + si * d));
  }
  if (d.z() < 0.0) {
    const double sg = -o.z() / d.z();
    const double g = 0.32 + 0.12 * Speckle(o.x() + sg * d.x(), o.y() + sg * d.y());
    take(sg, -2, Vector3d(g, 0.98 * g, 0.92 * g));
  }
  for (int axis = 0; axis < 2; ++axis) {
    const double wall = d[axis] > 0.0 ? kHallHalf : -kHallHalf;
    const double sw = (wall * 4.0 - o[axis]) / d[axis];
    const double g = 0.6 + 0.1 * Speckle(3.0 + (o + sw * d)[1 - axis], o.z() + sw * d.z());
    take(sw, -2, Vector3d(g, g, g));
  }
  if (hit.distance > 1e8) hit.rgb = Vector3d(0.7, 0.75, 0.8);
  return hit;
}

Shot Renderer::Image(double t) {
  const auto& rig = world_.rig;
  const Body body = world_.body(t);
  const Eigen::Matrix3d R_WC = body.R.toRotationMatrix() * rig.R_BC();
  const Vector3d eye = body.p + body.R * rig.camera_position;
  const auto ray = [&](double u, double v) {
    return Vector3d(R_WC * Vector3d((u - rig.center_u_px) / rig.focal_px,
                                    (v - rig.center_v_px) / rig.focal_px, 1.0));
  };
  Shot shot;
  shot.bgr.create(rig.height_px, rig.width_px, CV_8UC3);
  const Vector3d c = R_WC.transpose() * (world_.target(t) - eye);
  const double reach = c.z() > 0.1 ? 0.45 / c.z() * rig.focal_px : 0.0;
  const double cu = c.z() > 0.1 ? rig.Project(c).x() : -1e6,
               cv = c.z() > 0.1 ? rig.Project(c).y() : -1e6;
  double all = 0.0, open = 0.0, low_u = 1e9, low_v = 1e9, high_u = -1e9, high_v = -1e9;
  for (int y = static_cast<int>(cv - reach); y <= cv + reach; ++y)
    for (int x = static_cast<int>(cu - reach); x <= cu + reach; ++x) {
      if (Cast(eye, ray(x, y), t, false).thing != -1) continue;
      ++all;
      low_u = std::min(low_u, x - 0.5), high_u = std::max(high_u, x + 0.5);
      low_v = std::min(low_v, y - 0.5), high_v = std::max(high_v, y + 0.5);
      const bool inside = x >= 0 && y >= 0 && x < rig.width_px && y < rig.height_px;
      if (inside && Cast(eye, ray(x, y), t, true).thing == -1) ++open;
    }
  shot.target_px = all;
  shot.visible_share = all > 0.0 ? open / all : 0.0;
  if (all > 0.0) shot.box = {low_u, low_v, high_u - low_u, high_v - low_v};
  for (int y = 0; y < rig.height_px; ++y)
    for (int x = 0; x < rig.width_px; ++x) {
      const bool near = std::abs(x - cu) < reach + 4 && std::abs(y - cv) < reach + 4;
      const int n = near ? kSuper : 1;
      Vector3d sum = Vector3d::Zero();
      for (int k = 0; k < n * n; ++k)
        sum +=
            Cast(eye, ray(x + (k % n + 0.5) / n - 0.5, y + (k / n + 0.5) / n - 0.5), t, true).rgb;
      const Vector3d rgb = 235.0 * (sum / (n * n)).cwiseProduct(world_.light);
      for (int i = 0; i < 3; ++i)
        shot.bgr.at<cv::Vec3b>(y, x)[2 - i] =
            static_cast<uint8_t>(std::clamp(rgb[i] + Noise(world_.image_noise), 0.0, 255.0));
    }
  return shot;
}

perception::Sweep Renderer::Lidar(double t) {
  perception::Sweep sweep;
  sweep.t = t;
  std::uniform_real_distribution<double> u(0.0, 1.0);
  for (int column = 450; column < 1350; ++column) {
    const double dt = 0.1 * column / 1800.0, azimuth = M_PI - 2.0 * M_PI * column / 1800.0;
    const Body body = world_.body(t + dt);
    const Vector3d o = body.p + body.R * world_.rig.lidar_position;
    for (int ring = 0; ring < 16; ++ring) {
      const double elevation = (-15.0 + 2.0 * ring) * M_PI / 180.0;
      const Vector3d d_L(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      const Vector3d d = body.R * (world_.rig.R_BL() * d_L);
      const Hit hit = Cast(o, d, t + dt, true);
      if (hit.distance > 80.0 || u(random_) < world_.lidar_dropout) continue;
      sweep.points.push_back(((hit.distance + Noise(world_.lidar_noise)) * d_L).cast<float>());
      sweep.times.push_back(static_cast<float>(dt));
    }
  }
  return sweep;
}

perception::PoseSample Renderer::Pose(double t) {
  const double angle_sigma = world_.angle_noise_deg * M_PI / 180.0, tau = 2.0;
  const double decay = std::exp(-std::clamp(t - last_pose_t_, 0.0, 1e3) / tau);
  const double fresh = std::sqrt(1.0 - decay * decay);
  for (int i = 0; i < 3; ++i) {
    position_error_[i] = decay * position_error_[i] + fresh * Noise(world_.pose_noise);
    angle_error_[i] = decay * angle_error_[i] + fresh * Noise(angle_sigma);
  }
  last_pose_t_ = t;
  const double h = 1e-3;
  const Body at = world_.body(t), before = world_.body(t - h), after = world_.body(t + h);
  perception::PoseSample pose;
  pose.t = t;
  pose.p_WB = at.p + position_error_;
  pose.v_WB = (after.p - before.p) / (2.0 * h);
  pose.a_WB = (after.p - 2.0 * at.p + before.p) / (h * h);
  const Eigen::AngleAxisd turn(before.R.conjugate() * after.R);
  pose.w_WB_B = turn.angle() * turn.axis() / (2.0 * h);
  const double angle = angle_error_.norm();
  pose.R_WB =
      Eigen::AngleAxisd(angle, angle > 0.0 ? Vector3d(angle_error_ / angle) : Vector3d::UnitX()) *
      at.R;
  pose.covariance.diagonal() << Vector3d::Constant(world_.pose_noise * world_.pose_noise),
      Vector3d::Constant(angle_sigma * angle_sigma);
  return pose;
}

std::vector<Outcome> Fly(const World& world, const perception::PerceptionConfig& config,
                         const FlyOptions& options) {
  Renderer renderer(world);
  perception::Perceiver perceiver(config);
  std::vector<Outcome> outcomes;
  std::deque<std::pair<double, perception::Sweep>> pending;  // by the time of arrival
  const int ticks = static_cast<int>(std::lround(options.duration * 200.0));
  for (int k = 0; k <= ticks; ++k) {  // 200 Hz; a frame sees the pose of 5 ms ago as the newest
    const double t = k * 0.005;
    for (; !pending.empty() && t >= pending.front().first; pending.pop_front())
      perceiver.AddSweep(std::move(pending.front().second));
    if (options.lidar && k % 20 == 0)
      pending.emplace_back(t + options.lidar_delay, renderer.Lidar(t - 0.1));
    if (k % 10 == 0 && k > 0) {
      Shot shot = renderer.Image(t);
      if (options.spoil_image) options.spoil_image(t, &shot.bgr);
      Outcome out;
      const std::clock_t start = std::clock();  // processor time: others use this machine too
      out.estimate = perceiver.See({t, shot.bgr, {}});
      out.milliseconds = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      out.t = t;
      out.visible_share = shot.visible_share;
      out.truth = world.target(t);
      out.velocity = (world.target(t + 1e-3) - world.target(t - 1e-3)) / 2e-3;
      out.range = (out.truth - world.body(t).p).norm();
      outcomes.push_back(out);
    }
    if (!options.pose_arrives || options.pose_arrives(t)) perceiver.AddPose(renderer.Pose(t));
  }
  return outcomes;
}

perception::PerceptionConfig TakenAtOnce() {
  perception::PerceptionConfig config;
  config.state.standing_after = 0.0;
  return config;
}

World StillWorld(double distance) {
  World w;
  w.target = [distance](double) { return Vector3d(distance, 0.0, 0.55); };
  w.body = [distance](double t) {
    return Looking({0.02 * std::sin(t), 0.0, 1.2}, {distance, 0.0, 0.0}, 0.0, 0.0);
  };
  return w;
}

World GymWorld(uint32_t seed) {
  World w;
  w.seed = seed;
  std::mt19937 random(seed * 7919u + 1u);
  std::uniform_real_distribution<double> u(0.0, 1.0);
  const double a = 2.0 * M_PI * u(random), b = 2.0 * M_PI * u(random), c = 2.0 * M_PI * u(random);
  w.target = [a, b](double t) {
    return Vector3d(2.4 * std::sin(0.27 * t + a), 1.5 * std::sin(0.5 * t + b), 0.55);
  };
  const auto target = w.target;
  w.body = [a, b, c, target](double t) {
    const double d = 2.7 + 0.8 * std::sin(0.4 * t + b), phi = c + 0.22 * t;
    const Vector3d p = target(t) + Vector3d(d * std::cos(phi), d * std::sin(phi),
                                            0.75 + 0.2 * std::sin(0.3 * t + a));
    const Vector3d aim = target(t) + 0.25 * Vector3d(std::sin(0.9 * t), std::cos(0.7 * t), 0.0);
    return Looking(p, aim, 0.05 * std::sin(1.1 * t + c), 0.05 * std::sin(1.3 * t + a));
  };
  AddPillars(&w, 5, 7.0, 0.28, 0.28, {0.55, 0.6, 0.7}, 20.0, &random);
  // Same colour, wrong size: a big ball, a low box, a small one.
  const Vector3d m = w.target(5.0);
  w.things.push_back(
      {Thing::Kind::kSphere, {m.x() + 4.0, m.y() + 2.0, 0.8}, {0.5, 0.5, 0.5}, kOrange});
  w.things.push_back(
      {Thing::Kind::kBox, {m.x() - 4.0, m.y() + 3.0, 0.3}, {0.6, 0.3, 0.3}, kOrange});
  w.things.push_back(
      {Thing::Kind::kCylinder, {m.x() + 1.0, m.y() - 4.5, 0.15}, {0.06, 0.06, 0.15}, kOrange});
  if (seed % 2) w.light = {1.08, 0.92, 0.72};  // warm
  return w;
}

}  // namespace chase::perception_test
