#pragma once

#include <cstdint>

namespace chase::planning::kernels {

/// Plain arrays shared by the fast search and its vector kernels. The kernels are compiled twice
/// from one source (fast_kernels.inc), for AVX2 and for any processor, work on 8 lanes either way
/// and use no fused operations: both give the same bits.
constexpr int kLanes = 8;
constexpr int kMaxDegree = 6;
constexpr int kMaxFree = kMaxDegree - 3;     // control points that the start leaves free
constexpr int kMaxProduct = 2 * kMaxDegree;  // degree of d_p, d_q, d_s
constexpr int kQuadratureNodes = 20;
constexpr int kSplitDepth = 4;
constexpr int kTreeNodes = 2 << kSplitDepth;

/// One obstacle shape in whitened coordinates z = L' (x - c), |z| > 1 outside, as single precision
/// data for all candidates. Local frame: origin at the target's start.
struct Entry {
  float L[6];                                 ///< L00 L10 L20 L11 L21 L22
  float center[kMaxFree][3];                  ///< whitened centres at the free control points
  float p_const[kMaxProduct + 1];             ///< coefficients of d_p without free points
  float p_lin[kMaxProduct + 1][kMaxFree][3];  ///< and linear in them
  float s_const[kMaxProduct + 1];             ///< the same for d_s
  float s_lin[kMaxProduct + 1][kMaxFree][3];
  float plane[3];            ///< x-space normal of a plane that the fixed points clear
  float plane_at[kMaxFree];  ///< free point f clears it too where plane . x > plane_at[f]
  float margin;              ///< bounds the error of a coefficient of d_p, d_s
  float from;                ///< tau from which the entry is asked
  int asks_safety;           ///< P > 0 over all of it
  int asks_sight;            ///< the line of sight
  int exact;                 ///< exact sight condition, else the paper's bound
  uint32_t q_ready;          ///< bit per node: q_* are filled
  float q[kTreeNodes][kMaxProduct + 1];  ///< d_q over the dyadic intervals of [from, 1]
  float q_low[kTreeNodes];               ///< lower bound of d_q - 1
};

/// An obstacle near enough at a quadrature node to cost anything there.
struct NearNode {
  float L[6];
  float center[3];
  float weight;
};

struct Context {
  int degree;  ///< M
  int n_candidates;
  int stride;  ///< of the rows of x, a multiple of kLanes
  float* x;    ///< [3 (M - 3)][stride]: free control points of all candidates
  float* j1;   ///< [stride]: weighted J1
  // J1 = j1_offset + |j1_factor (x - j1_center)|^2 per axis
  float j1_factor[kMaxFree][kMaxFree];
  float j1_center[kMaxFree][3];
  float j1_offset;
  // Quadrature: p - q at a node = rel + sum phi_f x_f and its derivative.
  float phi[kQuadratureNodes][kMaxFree], slope[kQuadratureNodes][kMaxFree];
  float rel[kQuadratureNodes][3], rel_rate[kQuadratureNodes][2];
  float target[kQuadratureNodes][3];
  float weight3[kQuadratureNodes], weight4[kQuadratureNodes];
  float desired_distance, yaw_floor;
  float cost_range;
  const NearNode* near_nodes;
  int near_begin[kQuadratureNodes + 1];
  Entry* entries;
  int* order;  ///< of the entries, the most refusing first
  int n_entries;
};

/// Obstacles in columns, padded to kLanes, and what all candidates share, for Cull.
struct CullInput {
  int degree, n;   ///< n: padded
  const float* L;  ///< [6][n]
  const float* o;  ///< [M + 1][3][n]: Bernstein points of the centre
  float fixed[4][3], mid[kMaxFree][3], half[kMaxFree][3];
  float target[kMaxDegree + 1][3];
  float node_mid[kQuadratureNodes][3], node_half[kQuadratureNodes][3];
  float node_tau[kQuadratureNodes];
  float cost_range;
};

/// Per obstacle, columns of n.
struct CullOutput {
  float* low_plan;    ///< lower bound of the plane distance over all candidates
  float* low_fixed;   ///< the same of the fixed points alone
  float* low_target;  ///< and of the target
  float* normal;      ///< [3][n]: whitened unit normal
  uint32_t* near;     ///< bit k: may cost at node k
};

enum State : uint8_t { kClear = 0, kUnsure = 1, kDead = 2 };

struct Table {
  /// Free points of all candidates: those of a prefix plus those of the first step's choices.
  void (*generate)(Context& c, const float* prefix, int n_prefix, const float* first, int choices);
  /// Indices i with low < j1[i] <= high, ascending; `ids` needs room for stride + kLanes.
  int (*select)(const Context& c, float low, float high, int* ids);
  /// Adds quadrature nodes [begin, end) of the node order to value[i] of ids[i] and keeps those
  /// below `limit`; returns how many. Node order: kNodeOrder.
  int (*distance_and_yaw)(const Context& c, int* ids, float* value, int n, float limit, int begin,
                          int end);
  /// Adds J2 to value[i].
  void (*obstacles)(const Context& c, const int* ids, float* value, int n);
  /// Tests the candidates against all entries. Dead ones leave the list; returns how many stay and
  /// their states.
  int (*check)(Context& c, int* ids, uint8_t* state, int n);
  void (*cull)(const CullInput& in, CullOutput& out);
  const char* name;
};

/// The kernels for this processor; CHASE_KERNELS is not consulted: results do not depend on it.
const Table& Kernels();
const Table& PortableKernels();
const Table* Avx2Kernels();  ///< nullptr where the processor has none

}  // namespace chase::planning::kernels
