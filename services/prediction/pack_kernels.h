#pragma once

#include <cstddef>

namespace chase::prediction {

/// Columns are handled in blocks of this many; tables are laid out [block][dimension][lane].
constexpr int kLanes = 32;

/// out[j] = constant[j] + sum_d factors[d] table[d, j] for `blocks` blocks of columns; returns the
/// least. Every lane does the same operations in the same order at every vector width, without
/// fused multiply-adds, so that results do not depend on the processor.
float AffineRow(const float* constant, const float* table, const float* factors, int dims,
                int blocks, float* out);

/// alive[j] = 1 where values[j] < limit, else 0. Returns how many are 1.
int KeepBelow(const float* values, float limit, int blocks, int* alive);

/// Sets alive[j] = 0 where the point origin + points[:, j] (3 rows, same layout) lies within the
/// sphere of squared radius `limit` about zero. Returns how many stay at 1.
int MaskInside(const float* points, const float origin[3], float limit, int blocks, int* alive);

}  // namespace chase::prediction
