#include "services/mapping/occupancy_tree.h"

#include <sstream>

namespace chase::mapping {

namespace {

constexpr int kMiddle = 32768;          // OctoMap's key of the cell that starts at zero
constexpr int kTop = 15;                // the root's octants have an edge of 2^15 cells
constexpr int kTileLevels = 7;          // 2^7 cells
constexpr unsigned kAllAlike = 0x5555;  // times a state: eight octants in that state
constexpr unsigned kBits = 3;           // of an octant's state

bool InTree(const Key& key) {
  const auto in = [](int k) { return k >= -kMiddle && k < kMiddle; };
  return in(key.x) && in(key.y) && in(key.z);
}

/// Which octant with an edge of 2^level cells holds the cell.
unsigned Octant(const Key& key, int level) {
  const auto bit = [level](int k) { return static_cast<unsigned>(k + kMiddle) >> level & 1u; };
  return bit(key.x) + 2 * bit(key.y) + 4 * bit(key.z);
}

/// Sets the cube with an edge of 2^last cells around `key`, below `node` with octants of 2^level.
/// Octants that are all alike then are pruned.
void SetCube(const Key& key, int level, int last, Octants::State state, Octants* node) {
  const unsigned i = Octant(key, level);
  const Octants::State before = node->Get(i);
  if (before == state) return;
  if (level > last) {
    if (!node->parts) node->parts = std::make_unique<Octants[]>(8);
    Octants& part = node->parts[i];
    if (before != Octants::kParted) part.states = static_cast<uint16_t>(before * kAllAlike);
    SetCube(key, level - 1, last, state, &part);
    const bool alike = !part.parts && part.states == part.Get(0) * kAllAlike;
    state = alike ? part.Get(0) : Octants::kParted;
  }
  node->Put(i, state);
}

struct Stream {
  std::string bytes;
  size_t nodes = 0;
  int occupied = 0;  ///< cells
};

/// Appends OctoMap's "bt" stream of a node with octants of 2^level cells; of the tile that holds
/// the cell `within` only, if given.
void Append(const Octants& node, int level, const Key* within, Stream* out) {
  unsigned states = node.states;
  if (within && level >= kTileLevels) states &= kBits << 2 * Octant(*within, level);
  ++out->nodes;
  out->bytes.push_back(static_cast<char>(states & 0xff));
  out->bytes.push_back(static_cast<char>(states >> 8));
  for (unsigned i = 0; states != 0; ++i, states >>= 2) {
    const unsigned state = states & kBits;
    out->nodes += state == Octants::kFree || state == Octants::kOccupied;
    if (state == Octants::kOccupied) out->occupied += 1 << 3 * level;
    if (state == Octants::kParted) Append(node.parts[i], level - 1, within, out);
  }
}

size_t BytesBelow(const Octants& node) {
  if (!node.parts) return 0;
  size_t sum = 8 * sizeof(Octants);
  for (int i = 0; i < 8; ++i) sum += BytesBelow(node.parts[i]);
  return sum;
}

}  // namespace

void Octants::Put(unsigned i, State state) {
  states = static_cast<uint16_t>((states & ~(kBits << 2 * i)) | state << 2 * i);
  if (!parts || state == kParted) return;
  parts[i] = Octants();
  if ((states & states >> 1 & kAllAlike) == 0) parts.reset();
}

void OccupancyTree::Set(const Key& key, bool occupied) {
  if (!InTree(key)) return;
  SetCube(key, kTop, 0, occupied ? Octants::kOccupied : Octants::kFree, &root_);
  tiles_.insert({key.x >> kTileLevels, key.y >> kTileLevels, key.z >> kTileLevels});
}

void OccupancyTree::Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved) {
  const double edge = kTileCells * resolution_;
  for (auto it = tiles_.begin(); it != tiles_.end();) {
    const auto [x, y, z] = *it;
    const Eigen::Vector2d center(edge * (x + 0.5), edge * (y + 0.5));
    if ((center - p.head<2>()).norm() <= radius + 0.5 * edge) {
      ++it;
      continue;
    }
    const Key first{x * kTileCells, y * kTileCells, z * kTileCells};
    int occupied = 0;
    if (saved) saved->push_back({x, y, z, Write(&occupied, &first)});
    SetCube(first, kTop, kTileLevels, Octants::kUnknown, &root_);
    it = tiles_.erase(it);
  }
}

std::string OccupancyTree::Write(int* occupied, const Key* within) const {
  Stream stream;
  if (root_.states != 0) Append(root_, kTop, within, &stream);
  *occupied = stream.occupied;
  std::ostringstream out;
  out << "# Octomap OcTree binary file\n# (feel free to add / change comments, but leave the first "
         "line as it is!)\n#\nid OcTree\nsize "
      << stream.nodes << "\nres " << resolution_ << "\ndata\n"
      << stream.bytes;
  return out.str();
}

int OccupancyTree::State(const Eigen::Vector3d& p) const {
  const Eigen::Array3i k = (p / resolution_).array().floor().max(-1e9).min(1e9).cast<int>();
  const Key key{k.x(), k.y(), k.z()};
  if (!InTree(key)) return -1;
  const Octants* node = &root_;
  int level = kTop;
  while (node->Get(Octant(key, level)) == Octants::kParted)
    node = &node->parts[Octant(key, level--)];
  return static_cast<int>(node->Get(Octant(key, level))) - 1;
}

size_t OccupancyTree::Bytes() const { return BytesBelow(root_); }

}  // namespace chase::mapping
