#pragma once

#include <cstdint>

namespace chase::planning::kernels {

/// Plain arrays shared by the fast search and its vector kernels. The kernels are compiled from one
/// source (fast_*.inc) for AVX-512, AVX2 and any processor; every lane goes through the same
/// operations in the same order whatever the width, so all of them give the same bits.
constexpr int kPad = 16;  // candidates and obstacles are padded to multiples of this
constexpr int kBatch = 16;
constexpr int kMaxDegree = 6;
constexpr int kMaxFree = kMaxDegree - 3;     // control points that the start leaves free
constexpr int kMaxProduct = 2 * kMaxDegree;  // degree of d_p, d_q, d_s
constexpr int kMaxCenter = 7;                // power coefficients of a centre
constexpr int kQuadratureNodes = 20;
constexpr int kSplitDepth = 4;
constexpr int kGroupDepth = 2;  // of the test of groups, which may leave any open
constexpr int kTreeNodes = 2 << kSplitDepth;

/// Floats of the tables that `shape` leaves for one obstacle (see fast_shape.inc).
constexpr int kTableSize = 6 + 3 * kMaxFree + 2 * (kMaxProduct + 1) + (kMaxProduct + 1) +
                           3 * kMaxFree * 4 + 3 * kMaxFree * (kMaxDegree + 1) + 3 + kMaxFree + 2;

/// What one obstacle shape is asked. Local frame: origin at the target's start.
struct Row {
  float from;        ///< tau from which it is asked
  bool asks_safety;  ///< P > 0 over all of it
  bool asks_sight;   ///< the line of sight
};

/// d_q of a row over the dyadic intervals of [from, 1], filled when first needed.
struct Shadow {
  uint32_t ready;  ///< bit per node
  float low[kTreeNodes];
  float q[kTreeNodes][kMaxProduct + 1];
};

/// A shape near enough at a quadrature node to cost anything there.
struct NearNode {
  float L[6];
  float center[3];
  float weight;
  int row;
};

/// All obstacle shapes in columns of n, and what all candidates share.
struct ShapeInput {
  int degree, n, center_rows;  ///< n: padded
  const double* R;             ///< [6][n]: R00 R01 R02 R11 R12 R22
  const float* center;         ///< [center_rows][3][n]: power coefficients, local
  const Row* rows;             ///< [n]
  float fixed[4][3], mid[kMaxFree][3], half[kMaxFree][3];
  float target[kMaxDegree + 1][3];
  float reach;  ///< bounds the coordinates of fixed, free and target points
  float node_mid[kQuadratureNodes][3], node_half[kQuadratureNodes][3];
  float node_tau[kQuadratureNodes], node_weight[kQuadratureNodes];
  float cost_range;
  bool exact;  ///< exact sight condition, else the paper's bound
};

struct ShapeOutput {
  float* tables;      ///< kTableSize x n, read by the other kernels only
  float* L;           ///< [6][n] Cholesky factors: L00 L10 L20 L11 L21 L22
  float* low_plan;    ///< [n] lower bound of the plane distance over all candidates
  float* low_target;  ///< [n] and of the target
  float* low_sight;   ///< [n] above 1 where sight is clear for all candidates outside the shape
  float* margin;      ///< [n] bounds the error of a coefficient of d_p, d_q, d_s
  NearNode* near;     ///< room for kQuadratureNodes x n
  int near_begin[kQuadratureNodes + 1];
};

struct Context {
  int degree;  ///< M
  int n_candidates;
  int stride;  ///< of the rows of work, a multiple of kPad
  // Candidate i = p choices + s: its free control points are those of prefix p plus those of the
  // first step's choice s.
  float* prefix;       ///< [n / choices][kRecord]
  const float* first;  ///< [choices][kWhitened]: free points
  int choices;
  uint64_t inverse;  ///< 2^32 / choices, rounded up
  float* j1;         ///< [stride]: weighted J1
  float* work;       ///< [3 (M - 3)][stride], for `check`
  uint32_t* alive;   ///< [stride / 8], for `check`
  // Quadrature: p - q at a node = rel + sum phi_f x_f and its derivative.
  float phi[kQuadratureNodes][kMaxFree], slope[kQuadratureNodes][kMaxFree];
  float rel[kQuadratureNodes][3], rel_rate[kQuadratureNodes][2];
  float target[kQuadratureNodes][3];
  float weight3[kQuadratureNodes], weight4[kQuadratureNodes];
  int nodes[kQuadratureNodes];  ///< in the order in which they are asked
  float desired_distance, desired_height, rho_height, yaw_floor;
  float cost_range;
  const NearNode* near;
  const int* near_begin;  ///< [kQuadratureNodes + 1]
  const Row* rows;
  const float* tables;
  const float* margin;
  const float* slack;  ///< [n] of a group of candidates; null: single ones
  Shadow* shadows;
  int exact;   ///< exact sight condition, else the paper's bound
  int* order;  ///< rows that have to be tested, the most refusing first
  int n_rows;
};

/// Shapes in columns of n, double precision, for `prove`.
struct ProofInput {
  int n;                 ///< padded
  const double* R;       ///< [6][n]
  const double* sum_R;   ///< [n]: sum of |R_ab|
  const double* center;  ///< [2][3][n]: centres are linear in tau
  const uint8_t* sight;  ///< [n]: asks for sight
  bool exact;            ///< exact sight condition, else the paper's bound
  int degree;            ///< of plan and target, 5 or 6
  double plan[kMaxDegree + 1][3], target[kMaxDegree + 1][3];
  double size;  ///< bounds |coordinates| of points and centres, summed over power coefficients
};

/// One shape, what it is asked, and a plan and a target relative to its centre; double precision.
struct FormInput {
  int degree;                                         ///< of plan and target, 5 or 6
  double x[kMaxDegree + 1][3], y[kMaxDegree + 1][3];  ///< control points of plan and target
  double X, Y;                                        ///< bound their coordinates
  double R[3][3];
  double from;  ///< tau from which it is asked
  bool sight;   ///< of the line of sight, else of the plan alone
  bool exact;   ///< exact sight condition, else the paper's bound
};

/// What the skeletons of one step, or of several, add to the free control points (3 f + axis), and
/// from kWhitened on, whitened, to the root of J1.
constexpr int kWhitened = 16, kRecord = 32;

struct CandidateInput {
  const double* records;  ///< [step][choice][kRecord]
  const int* choices;     ///< [steps]
  int steps;
  double base[kRecord];               ///< without skeletons
  const float* first_whitened;        ///< [3 (M - 3)][first_row], of the first step
  double first_middle[3 * kMaxFree];  ///< of those
  const float* second_whitened;       ///< [3 (M - 3)][second_row], of the second step, if any
  int first_row, second_row;          ///< choices, padded
  float j1_offset;                    ///< J1 = j1_offset + |whitened|^2
  /// Where the prefix' whitened sum and first_middle are longer, squared, J1 may stay infinite.
  float longest2;
};

constexpr int kPaddedNodes = 24;  // quadrature nodes; the padding weighs nothing
constexpr int kNearSize = 6 + 3 * kPaddedNodes;

/// The objective of Problem 2 as a function of the free control points, double precision.
struct ObjectiveInput {
  int free;
  double smooth[kMaxFree][kMaxFree];  ///< weighted J1 = sum x_f smooth x_g + 2 pull x + rest
  double pull[kMaxFree][3], rest;
  double phi[kMaxFree][kPaddedNodes], slope[kMaxFree][kPaddedNodes];
  double at[3][kPaddedNodes];   ///< the plan without its free points, local
  double rel[3][kPaddedNodes];  ///< the same less the target
  double rate[2][kPaddedNodes];
  double weight[kPaddedNodes];  ///< with the duration
  double weight_obstacle, weight_distance, weight_yaw;
  double desired_distance, desired_height, rho_height, yaw_floor, cost_range;
  const double* near;  ///< [n_near][kNearSize]: R00 R01 R02 R11 R12 R22, centre at the nodes
  int n_near;
};

constexpr int kSamples = 24;  // equally spaced instants, the last at tau = 1

/// Where plans pass shapes; local frame, shapes in columns of n.
struct ClearanceInput {
  int free;
  int n, rows;           ///< n: padded
  const double* R;       ///< [6][n]
  const double* center;  ///< [2][3][n]: centres are linear in tau
  const uint8_t* sight;  ///< [n]: the segment to the target counts, else the plan alone
  double tau[kSamples], phi[kMaxFree][kSamples];
  double at[3][kSamples];  ///< the plan without its free points
  double target[3][kSamples];
};

/// Unweighted parts: J1's weighted value, and the integrals of (l - l_s)^2 below l_s, J3 and J4.
struct ObjectiveParts {
  double smooth, near, distance, yaw;
};

/// Slope and Gauss-Newton curvature (lower triangle) of the weighted sum.
struct ObjectiveModel {
  double gradient[3 * kMaxFree];
  double hessian[3 * kMaxFree][3 * kMaxFree];
};

/// Verdict on a candidate, or the row (>= 0) whose test single precision left open.
enum State : int { kClear = -1, kDead = -2 };

struct Table {
  /// Bounds, tables and near nodes of all shapes.
  void (*shape)(const ShapeInput& in, ShapeOutput& out);
  /// Prefixes, and J1 of all candidates; where longest2 rules a prefix out, J1 is infinite and the
  /// prefix unset.
  void (*generate)(Context& c, const CandidateInput& in);
  /// Indices i with low < j1[i] <= high, ascending; `ids` needs room for stride + kPad.
  int (*select)(const Context& c, float low, float high, int* ids);
  /// Sets `nodes` by what they cost the candidates ids[0], ids[stride] ... of kPad, the most first.
  void (*order_nodes)(Context& c, const int* ids, int stride);
  /// Adds quadrature nodes [begin, end) of `nodes` to value[i] of ids[i] and keeps those
  /// below `limit`; returns how many.
  int (*distance_and_yaw)(const Context& c, int* ids, float* value, int n, float limit, int begin,
                          int end);
  /// Adds J2 to value[i].
  void (*obstacles)(const Context& c, const int* ids, float* value, int n);
  /// Tests the candidates against all rows of `order`. Dead ones leave the list; returns how many
  /// stay and their states.
  int (*check)(Context& c, int* ids, int* state, int n);
  /// Tests groups of candidates, group g at prefix g + mid: `ids` gets those with members that may
  /// be feasible. Needs c.slack.
  int (*check_groups)(Context& c, const float* mid, int n, int* ids, int* state);
  /// As `check` for up to kBatch candidates, in registers.
  int (*check_batch)(Context& c, int* ids, int* state, int n);
  /// holds[j] = 1 where bounds over the whole horizon prove what shape j asks.
  void (*prove)(const ProofInput& in, uint8_t* holds);
  /// Above 0: what the shape asks holds, proven; below 0: it does not; 0: open at this depth.
  int (*decide)(const FormInput& in, int depth);
  ObjectiveParts (*objective)(const ObjectiveInput& in, const double* x);
  void (*model)(const ObjectiveInput& in, const double* x, ObjectiveModel& out);
  /// values[row][kSamples]: squared distance from the row's centre in its own shape; least[row].
  void (*clearance)(const ClearanceInput& in, const double* x, double* values, double* least);
  const char* name;
};

/// The kernels for this processor.
const Table& Kernels();
const Table& PortableKernels();
const Table* Avx2Kernels();    ///< nullptr where the processor has none
const Table* Avx512Kernels();  ///< nullptr where the processor has none

}  // namespace chase::planning::kernels
