#include "services/mapping/occupancy_tree.h"

#include <octomap/octomap.h>

#include <sstream>

namespace chase::mapping {

namespace {

constexpr int kMiddle = 32768;     // OctoMap's key of the cell that starts at zero
constexpr int kTileLevels = 7;     // 2^7 cells
constexpr float kOccupied = 2.0f;  // log-odds written
constexpr float kFree = -1.0f;

octomap::OcTreeKey TreeKey(const Key& key) {
  const auto unsign = [](int k) { return static_cast<octomap::key_type>(k + kMiddle); };
  return {unsign(key.x), unsign(key.y), unsign(key.z)};
}

bool InTree(const Key& key) {
  const auto in = [](int k) { return k >= -kMiddle && k < kMiddle; };
  return in(key.x) && in(key.y) && in(key.z);
}

/// Gives all children below a node the same value and removes them. OctoMap frees a node's list of
/// children only by pruning.
void Collapse(octomap::OcTree* tree, octomap::OcTreeNode* node) {
  if (!tree->nodeHasChildren(node)) return;
  for (unsigned i = 0; i < 8; ++i) {
    if (!tree->nodeChildExists(node, i)) tree->createNodeChild(node, i);
    octomap::OcTreeNode* child = tree->getNodeChild(node, i);
    Collapse(tree, child);
    child->setLogOdds(0.0f);
  }
  tree->pruneNode(node);
}

/// Removes the node of `key` at `depth` from below `node`, which lies at depth `level`. True if
/// `node` is then empty itself. (OctoMap's own deleteNode keeps lists of children alive.)
bool Remove(octomap::OcTree* tree, octomap::OcTreeNode* node, const octomap::OcTreeKey& key,
            unsigned depth, unsigned level) {
  if (level == depth) {
    Collapse(tree, node);
    return true;
  }
  const unsigned i =
      octomap::computeChildIdx(key, static_cast<int>(tree->getTreeDepth() - 1 - level));
  if (!tree->nodeHasChildren(node) || !tree->nodeChildExists(node, i)) return false;
  if (!Remove(tree, tree->getNodeChild(node, i), key, depth, level + 1)) return false;
  tree->deleteNodeChild(node, i);
  if (tree->nodeHasChildren(node)) return false;
  tree->createNodeChild(node, 0);
  Collapse(tree, node);
  return true;
}

/// Makes what lies below a node of `part` what lies below a node of `tree`.
void Copy(const octomap::OcTree& tree, const octomap::OcTreeNode* from, octomap::OcTree* part,
          octomap::OcTreeNode* to) {
  if (!tree.nodeHasChildren(from)) {
    Collapse(part, to);
    to->setLogOdds(from->getLogOdds());
    return;
  }
  for (unsigned i = 0; i < 8; ++i)
    if (tree.nodeChildExists(from, i))
      Copy(tree, tree.getNodeChild(from, i), part,
           part->nodeHasChildren(to) && part->nodeChildExists(to, i)
               ? part->getNodeChild(to, i)
               : part->createNodeChild(to, i));
}

/// Cells of the occupied leaves below a node whose own edge is 2^level cells.
int CountOccupied(const octomap::OcTree& tree, const octomap::OcTreeNode* node, unsigned level) {
  if (!tree.nodeHasChildren(node)) return tree.isNodeOccupied(node) ? 1 << 3 * level : 0;
  int sum = 0;
  for (unsigned i = 0; i < 8; ++i)
    if (tree.nodeChildExists(node, i))
      sum += CountOccupied(tree, tree.getNodeChild(node, i), level - 1);
  return sum;
}

/// OctoMap's "bt" stream. Its own writer does the same but prints to the console.
std::string ToBytes(const octomap::OcTree& tree) {
  std::ostringstream out;
  out << "# Octomap OcTree binary file\n# (feel free to add / change comments, but leave the first "
         "line as it is!)\n#\nid "
      << tree.getTreeType() << "\nsize " << tree.size() << "\nres " << tree.getResolution()
      << "\ndata\n";
  tree.writeBinaryData(out);
  return out.str();
}

}  // namespace

OccupancyTree::OccupancyTree(double resolution)
    : tree_(std::make_unique<octomap::OcTree>(resolution)) {}

OccupancyTree::~OccupancyTree() = default;

void OccupancyTree::Set(const Key& key, bool occupied) {
  if (!InTree(key)) return;
  tree_->setNodeValue(TreeKey(key), occupied ? kOccupied : kFree);
  tiles_.insert({key.x >> kTileLevels, key.y >> kTileLevels, key.z >> kTileLevels});
}

void OccupancyTree::Forget(const Eigen::Vector3d& p, double radius, std::vector<SavedTile>* saved) {
  const double edge = kTileCells * tree_->getResolution();
  for (auto it = tiles_.begin(); it != tiles_.end();) {
    const auto [x, y, z] = *it;
    const Eigen::Vector2d center(edge * (x + 0.5), edge * (y + 0.5));
    if ((center - p.head<2>()).norm() <= radius + 0.5 * edge) {
      ++it;
      continue;
    }
    if (saved) saved->push_back({x, y, z, Serialise(*it)});
    Drop(*it);
    it = tiles_.erase(it);
  }
}

std::string OccupancyTree::Serialise(const Tile& tile) const {
  const auto [x, y, z] = tile;
  octomap::OcTree part(tree_->getResolution());
  const auto corner = [](int t, int cell) {
    return static_cast<octomap::key_type>(t * kTileCells + cell + kMiddle);
  };
  const octomap::OcTreeKey low(corner(x, 0), corner(y, 0), corner(z, 0));
  const int last = kTileCells - 1;
  const octomap::OcTreeKey high(corner(x, last), corner(y, last), corner(z, last));
  const auto leaf = tree_->begin_leafs_bbx(low, high);
  if (leaf == tree_->end_leafs_bbx()) return ToBytes(part);
  const unsigned depth = part.getTreeDepth() - kTileLevels;
  const octomap::OcTreeKey key = leaf.getDepth() < depth ? low : leaf.getKey();
  part.setNodeValue(key, leaf->getLogOdds());  // makes the way down to the tile
  Copy(*tree_, tree_->search(key, depth), &part, part.search(key, depth));
  return ToBytes(part);
}

void OccupancyTree::Drop(const Tile& tile) {
  const auto [x, y, z] = tile;
  const octomap::OcTreeKey key = TreeKey({x * kTileCells, y * kTileCells, z * kTileCells});
  const unsigned depth = tree_->getTreeDepth() - kTileLevels;
  if (tree_->getRoot() && Remove(tree_.get(), tree_->getRoot(), key, depth, 0)) tree_->clear();
}

std::string OccupancyTree::Write(int* occupied) {
  const octomap::OcTreeNode* root = tree_->getRoot();
  *occupied = root ? CountOccupied(*tree_, root, tree_->getTreeDepth()) : 0;
  return ToBytes(*tree_);
}

int OccupancyTree::State(const Eigen::Vector3d& p) const {
  const octomap::OcTreeNode* node = tree_->search(p.x(), p.y(), p.z());
  return node ? (tree_->isNodeOccupied(node) ? 1 : 0) : -1;
}

size_t OccupancyTree::Bytes() const { return tree_->memoryUsage(); }

}  // namespace chase::mapping
