#pragma once

#include <cstdint>

namespace chase::prediction {

/// Points are handled in blocks of this many; a table of `dims` rows is laid out [dims][lane].
constexpr int kLanes = 32;

/// A sum of squares about `constant`, for the points of a table: its first `dims` rows.
struct SquaresTerm {
  int dims = 0;
  float constant = 0.0F;
  float radius = 0.0F;  ///< the points may be off by so much
};

/// The vector kernels, one set per instruction set. Every lane does the same operations in the same
/// order, without fused multiply-adds, so that results do not depend on the processor.
struct Kernels {
  /// out[j] = a lower bound of sum + exp(exponent), each of them constant + ||origin + point_j||^2;
  /// the rows of `sum` come first in `table` and `origin`, then those of `exponent`. Relative
  /// margin for rounding 1e-5; of points whose bit in `wanted` is not set any number may be
  /// written; the exponential is held at e^80.
  void (*cost_bounds)(const SquaresTerm& sum, const SquaresTerm& exponent, const float* table,
                      const float* origin, uint32_t wanted, float* out);
  /// Bit j is set where ||origin + point_j||^2 < limit; 3 rows; bits not `wanted` stay off.
  uint32_t (*inside)(const float* table, const float* origin, uint32_t wanted, float limit);
};

const Kernels& BaselineKernels();
/// The best that this processor can run.
const Kernels& BestKernels();

}  // namespace chase::prediction
