#pragma once

#include <Eigen/Core>
#include <map>
#include <set>
#include <vector>

#include "services/mapping/enclosing.h"
#include "services/mapping/mapping_config.h"

namespace chase::mapping {

/// An occupied column in plan: the octagon around its returns.
struct Cell {
  int x = 0, y = 0;   ///< column
  int piece = 0;      ///< that it belonged to; 0: none. Written by Decomposition::Update.
  Points2 corners;    ///< frame W, m
  double area = 0.0;  ///< of the octagon's bounding box, m^2
};

/// Part of the static world that one upright elliptic column encloses.
struct Piece {
  int id = 0;
  std::vector<int> cells;  ///< indices into the cells of the last update
  Ellipse outline;         ///< in plan, frame W, m
  Rectangle rectangle;     ///< about the outline's centre, holds the same cells
  double radius = 0.0;     ///< of a circle about it that does, m
};

/// Keeps a partition of occupied columns into pieces from sweep to sweep, so that ids are stable:
/// a column stays with its piece, new columns join a neighbour where the outline stays tight, and
/// pieces split when they waste space and merge when they do not.
class Decomposition {
 public:
  Decomposition(const StaticConfig& config, double resolution);

  /// Assigns every cell to a piece (Cell::piece) and returns the pieces by id. `partial`: ids of
  /// pieces that go on where `cells` end; they merge with no other, since how long they are is not
  /// seen. No outline holds `keep_out` (if given) unless a single column does; such pieces are left
  /// out and counted.
  std::vector<Piece> Update(std::vector<Cell>* cells, const std::set<int>& partial,
                            const Eigen::Vector2d* keep_out, double keep_out_radius);
  int dropped() const { return dropped_; }

  /// The outline of a set of points in plan: a circle where that is round enough, a thin ellipse
  /// around walls, else the ellipse of least area.
  Ellipse Outline(const Points2& points) const;

 private:
  using Group = std::vector<int>;

  Points2 Hull(const std::vector<Cell>& cells, const Group& group) const;
  bool Tight(const std::vector<Cell>& cells, const Group& group, double strictness) const;
  void Split(const std::vector<Cell>& cells, const Group& group, std::vector<Group>* out) const;
  bool Cut(const std::vector<Cell>& cells, const Group& group, Group* a, Group* b) const;
  void Adopt(const std::vector<Cell>& cells, std::map<int, Group>* groups, Group* orphans) const;
  void AddNew(const std::vector<Cell>& cells, const Group& orphans, std::map<int, Group>* groups);
  void SplitWasteful(const std::vector<Cell>& cells, std::map<int, Group>* groups);
  bool Merge(const std::vector<Cell>& cells, const std::set<int>& partial,
             std::map<int, Group>* groups) const;
  void Emit(const std::vector<Cell>& cells, int id, const Group& group,
            const Eigen::Vector2d* keep_out, double keep_out_radius, int depth,
            std::vector<Piece>* pieces);

  StaticConfig config_;
  double resolution_;
  int next_id_ = 1;
  int dropped_ = 0;
};

}  // namespace chase::mapping
