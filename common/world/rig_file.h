#pragma once

#include "common/world/rig.h"

namespace chase::world {

/// The calibration file that services load by --config: key `rig`.
struct RigFile {
  Rig rig;

  template <class V>
  void Visit(V& v) {
    v("rig", rig, "where the sensors sit, and the camera");
  }
  std::string Problem() const { return rig.LensProblem(); }
};

}  // namespace chase::world
