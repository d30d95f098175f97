#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "common/world/random.h"
#include "common/world/rig.h"
#include "services/simulator/projection.h"
#include "services/simulator/scene.h"
#include "services/simulator/tile_bins.h"

namespace chase::simulator {

struct CameraConfig {
  double rate = 20.0;
  double noise = 3.0;
  double exposure_variation = 0.12;
  double exposure = 0.005;
  double light = 1.0;

  template <class V>
  void Visit(V& v) {
    v("rate", rate, "frames, Hz; 0: none");
    v("noise", noise, "standard deviation of a colour value of 0 to 255");
    v("exposure_variation", exposure_variation,
      "amplitude of the slow change of brightness, share");
    v("exposure", exposure, "s");
    v("light", light, "brightness of the world, 1: day");
  }
  std::string Problem() const;
};

struct Image {
  int width = 0, height = 0;
  double exposure = 0.0;     ///< s
  std::vector<uint8_t> rgb;  ///< rows from the top, 3 bytes a pixel
};

/// What a frame shows of the target, from the geometry itself.
struct TargetView {
  Eigen::Vector2d px = {-1.0, -1.0};  ///< u v of the centre; -1 -1 behind the camera
  bool in_image = false;              ///< the centre projects into the image
  double visible_share = 0.0;  ///< pixels seen over pixels that would be with nothing in the way
};

/// Pinhole camera on the rig: Lambert shading under one sun, procedural textures, noise.
class Camera {
 public:
  Camera(const CameraConfig& config, const world::Rig& rig, const Eigen::Vector3d& target_color,
         uint64_t seed);

  /// The frame seen from a body pose at time t [s]. The scene stands at that time, with the
  /// target's cylinder as given.
  Image Render(const Eigen::Vector3d& p_WB, const Eigen::Quaterniond& q_WB, double t,
               const Scene& scene, const world::Solid& target);

  /// The target in the last frame.
  TargetView View() const;

 private:
  void TraceTile(int row, int column, const Scene& scene, Image* image);
  double NextBrightness(double t);
  RayPacket Rays(int row, int column) const;
  bool MoversIn(int row, int column) const;
  long CountAlone(const Scene& scene) const;
  void AddNoise(Image* image);

  CameraConfig config_;
  world::Rig rig_;
  Eigen::Vector3f target_color_;
  world::Random random_;
  std::vector<int8_t> noise_;  // samples of the noise, a row of them from a random place
  std::vector<float> u_;       // of the columns, in focal lengths, and of some beyond
  double phase_ = 0.0;

  // The last frame.
  Viewpoint view_;
  world::Solid target_;
  TileBins bins_;                 // what stands
  std::vector<PixelBox> movers_;  // around all that moves
  float brightness_ = 1.0f;
  long alone_px_ = 0, visible_px_ = 0;
};

}  // namespace chase::simulator
