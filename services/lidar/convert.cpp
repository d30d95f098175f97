#include "services/lidar/convert.h"

namespace chase::lidar {

lidar_scan_t ToMessage(const Sweep& sweep, int64_t utime) {
  lidar_scan_t m{};
  m.utime = utime;
  m.size = static_cast<int32_t>(sweep.points.size());
  for (auto* list : {&m.x, &m.y, &m.z, &m.t}) list->reserve(sweep.points.size());
  for (auto* list : {&m.intensity, &m.ring}) list->reserve(sweep.points.size());
  for (const Point& p : sweep.points) {
    m.x.push_back(p.x);
    m.y.push_back(p.y);
    m.z.push_back(p.z);
    m.t.push_back(static_cast<float>(p.t));
    m.intensity.push_back(p.intensity);
    m.ring.push_back(p.ring);
  }
  return m;
}

}  // namespace chase::lidar
