// What the kernels of a spline sheet read and write, in plain arrays.
//
// The kernels are compiled three times, for plain x86-64, AVX2 and AVX-512, and chosen when the program runs. So that
// no inline function compiled for a newer processor can serve an older one, they include nothing but this and what lies
// beside it, and own no memory. T: float or double.
//
// A field of the sheet is [axis][row along v][column along u][lane]; a material number is [lane].
#pragma once

namespace selvedge::cloth::spline::kernel {

// One direction. Functions alive at a point: first … first + 3.
template <class T>
struct SideTables {
  int functions = 0, points = 0;
  const int* first = nullptr;                                          // one a point
  const T *value = nullptr, *slope = nullptr, *second = nullptr;       // four a point; 1, 1/m, 1/m²
  const T* weight = nullptr;                                           // one a point, m
  const T *mass = nullptr, *slope_product = nullptr, *bend = nullptr;  // rows of seven: columns i − 3 … i + 3
  const T* inverse = nullptr;                                          // rows of thirteen: columns i − 6 … i + 6
  // At the Greville point of each function, four each of functions alive from its own first; and each one's area.
  const int* greville_first = nullptr;
  const T *greville_value = nullptr, *greville_slope = nullptr, *area = nullptr;  // 1, 1/m, m
};

// Rows of the materials' table.
enum Row {
  kStretchU,
  kStretchV,
  kCoupling,
  kStiffening,
  kSoftening,
  kShear,
  kStretchDamping,
  kShearDamping,
  kBendUU,
  kBendUV,
  kBendVV,
  kBendDamping,
  kBendStiffening,
  kRestU,
  kRestV,
  kDragNormal,
  kDragTangent,
  kDragFade,
  kDragLinear,
  kInverseDensity,
  kStretchFriction,
  kStretchFrictionSlope,
  kBendFriction,
  kBendFrictionSlope,
  kCreep,
  kCreepRate,
  kGravityX,
  kGravityY,
  kGravityZ,
  kAirX,
  kAirY,
  kAirZ,
  kRows
};

// What is held: sums over control points, and what answers where a sum is off by 1.
template <class T>
struct HeldTables {
  int count = 0;
  const int* reads_start = nullptr;  // count + 1
  const int* reads_point = nullptr;
  const T* reads_weight = nullptr;
  const int* moves_start = nullptr;  // count + 1
  const int* moves_point = nullptr;
  const T* moves_weight = nullptr;  // [entry][lane]
  T* position = nullptr;            // where each is to be at the beginning of the step, [held][axis][lane], m
  T* velocity = nullptr;            // over the step, m/s
};

inline constexpr int kMembraneMemory = 6, kBendMemory = 3;  // numbers a point

template <class T>
struct Run {
  SideTables<T> u, v;
  const T* material = nullptr;  // [Row][lane]
  // In place of u.inverse and v.inverse: rows of 2 reach + 1, [entry][lane] (damped_inertia.h); null: those.
  const T *inverse_u = nullptr, *inverse_v = nullptr;
  int inverse_reach = 0;
  const T* mass_scale = nullptr;   // [control point][lane]; null: 1
  const T* air_share = nullptr;    // [control point][lane], carried_air.h; null: no lane carries air
  T* air = nullptr;                // a field, carried_air.h
  const T* bend_factor = nullptr;  // [point of the rule][lane], by which rigidity exceeds the material's; null: 1
  bool uses_moments = false;       // bending is more than three even rigidities
  bool uses_normals = false;       // of these: friction or rest curvature
  bool uses_membrane_memory = false;
  HeldTables<T> held;
  T step_s = 0;
  T memory_step_s = 0;  // 0 leaves friction and creep
  int stages = 1;       // cloth/kernel/run.h, DampingStages
  const T *mu = nullptr, *nu = nullptr, *gain = nullptr;
  T *x = nullptr, *v_half = nullptr;  // m, m/s
  T* force = nullptr;                 // N
  T* acceleration = nullptr;          // m/s²
  T* change[3] = {nullptr, nullptr, nullptr};
  T* scratch = nullptr;          // scratch_size() numbers
  T* kept = nullptr;             // nine a point of the rule; null where no stages follow
  T* membrane_memory = nullptr;  // kMembraneMemory a point of the rule
  T* bend_memory = nullptr;      // kBendMemory a point
};

template <class T>
constexpr long scratch_size(const Run<T>& run, int lanes) {
  const long rows = 18L * run.u.functions, fields = 3L * run.u.functions * run.v.functions;
  return (rows + fields) * lanes;
}

// Adds nothing outside `force`: it is set to the fabric's and the air's forces at x and v_half.
template <class T>
using Forces = void (*)(const Run<T>&);
// One step of the leapfrog from `force`: v_half and x are brought forward, what is held where it is to be.
template <class T>
using Advance = void (*)(const Run<T>&);

// One width of lanes as compiled for one kind of processor.
template <class T>
struct Kernels {
  int lanes = 0;
  Forces<T> forces = nullptr;
  Advance<T> advance = nullptr;
};

// The narrowest of this processor's that holds `lanes` of T side by side, or its widest.
template <class T>
Kernels<T> kernels_for(int lanes);
extern template Kernels<float> kernels_for<float>(int);
extern template Kernels<double> kernels_for<double>(int);

// The widest.
template <class T>
int most_lanes();
extern template int most_lanes<float>();
extern template int most_lanes<double>();

// A symmetric matrix of `count` × `count` blocks of 8 × 8, of which those up to `reach` below the diagonal are not 0:
// lower blocks, column of blocks by column of blocks, each block's columns after one another. Aligned as vectors are.
struct BandedMatrix {
  int count = 0, reach = 0;
  double* blocks = nullptr;    // count · (reach + 1) of them
  double* inverses = nullptr;  // one a column: of the factor's diagonal block
};

inline constexpr int kBandedSides = 8;  // right-hand sides that are solved for at once

struct BandedKernels {
  bool (*factor)(const BandedMatrix&) = nullptr;            // in place; false: it is not positive definite
  void (*solve)(const BandedMatrix&, double* y) = nullptr;  // y: [row][side], of factors
};
BandedKernels banded_kernels();

}  // namespace selvedge::cloth::spline::kernel
