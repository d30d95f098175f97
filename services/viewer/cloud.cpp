#include "services/viewer/cloud.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace chase::viewer {
namespace {

constexpr double kFinest = 0.1;        // m; finer cannot be told apart on the page
constexpr double kFarthest = 10000.0;  // m; keeps a cell's number within 21 bits
constexpr int64_t kCells = int64_t{1} << 21;
constexpr double kCentimetre = 0.01;

using Cell = std::pair<int64_t, size_t>;  // number of the cell, index of a point in it

bool Usable(double v) { return std::abs(v) < kFarthest; }  // false for NaN

int64_t Along(double v, double edge) { return std::llround(v / edge) + kCells / 2; }

template <class T>
void Append(const T& value, std::string* out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out->append(bytes, sizeof(T));
}

int16_t Centimetres(double metres) {
  return static_cast<int16_t>(std::clamp(std::nearbyint(metres / kCentimetre), -32767.0, 32767.0));
}

}  // namespace

std::vector<size_t> Thinned(const std::vector<float>& x, const std::vector<float>& y,
                            const std::vector<float>& z, size_t most) {
  const size_t n = std::min({x.size(), y.size(), z.size()});
  std::vector<size_t> kept;
  for (size_t i = 0; i < n; ++i)
    if (Usable(x[i]) && Usable(y[i]) && Usable(z[i])) kept.push_back(i);
  std::vector<Cell> cells;
  for (double edge = kFinest; kept.size() > most && edge < kFarthest; edge *= std::sqrt(2.0)) {
    cells.clear();
    for (const size_t i : kept)
      cells.emplace_back(
          (Along(x[i], edge) * kCells + Along(y[i], edge)) * kCells + Along(z[i], edge), i);
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end(),
                            [](const Cell& a, const Cell& b) { return a.first == b.first; }),
                cells.end());
    kept.clear();
    for (const Cell& cell : cells) kept.push_back(cell.second);
  }
  kept.resize(std::min(kept.size(), most));
  return kept;
}

std::string EncodeCloud(double t, int generation, const Eigen::Vector3d& centre,
                        const std::vector<float>& x, const std::vector<float>& y,
                        const std::vector<float>& z, size_t most) {
  const std::vector<size_t> kept = Thinned(x, y, z, most);
  const Eigen::Vector3d origin = centre.allFinite() ? centre : Eigen::Vector3d::Zero();
  std::string out;
  Append(static_cast<uint32_t>(generation) << 8 | 1U, &out);
  Append(static_cast<uint32_t>(kept.size()), &out);
  Append(t, &out);
  for (int k = 0; k < 3; ++k) Append(origin[k], &out);
  for (const size_t i : kept) {
    Append(Centimetres(x[i] - origin.x()), &out);
    Append(Centimetres(y[i] - origin.y()), &out);
    Append(Centimetres(z[i] - origin.z()), &out);
  }
  return out;
}

}  // namespace chase::viewer
