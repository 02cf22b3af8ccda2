// The elementary functions of the program and of all libraries it loads: these definitions take
// the place of libm's, which choose their code, and so the last bits of their results, by the CPU's
// optional instructions. They call SLEEF's deterministic functions, which neither choose nor use
// fused multiply-add. Why these, and why with up to 3.5 units in the last place:
// doc/decisions/pinned-mathematics.md.
//
// Functions that IEEE 754 defines exactly (sqrt, fma, floor, fmod, remainder, ...) are libm's.
// Every function here is also listed in cmake/PinnedFunctions.list; a test checks that the
// libraries use them.

#include <sleef.h>

// NOLINTBEGIN: the names and types are libm's.
#define DIVE_PIN_1(name, accuracy)                                                      \
  double name(double x) noexcept { return Sleef_cinz_##name##d1_##accuracy##purec(x); } \
  float name##f(float x) noexcept { return Sleef_cinz_##name##f1_##accuracy##purec(x); }
#define DIVE_PIN_2(name, accuracy)                        \
  double name(double x, double y) noexcept {              \
    return Sleef_cinz_##name##d1_##accuracy##purec(x, y); \
  }                                                       \
  float name##f(float x, float y) noexcept { return Sleef_cinz_##name##f1_##accuracy##purec(x, y); }

extern "C" {

/// Referred to by every program that is linked with the module, so that the linker includes this
/// file (common/CMakeLists.txt).
extern const char dive_pinned_functions;
const char dive_pinned_functions = 0;

DIVE_PIN_1(sin, u35)
DIVE_PIN_1(cos, u35)
DIVE_PIN_1(tan, u35)
DIVE_PIN_1(asin, u35)
DIVE_PIN_1(acos, u35)
DIVE_PIN_1(atan, u35)
DIVE_PIN_2(atan2, u35)
DIVE_PIN_1(sinh, u10)
DIVE_PIN_1(cosh, u10)
DIVE_PIN_1(tanh, u10)
DIVE_PIN_1(asinh, u10)
DIVE_PIN_1(acosh, u10)
DIVE_PIN_1(atanh, u10)
DIVE_PIN_1(exp, u10)
DIVE_PIN_1(exp2, u10)
DIVE_PIN_1(exp10, u10)
DIVE_PIN_1(expm1, u10)
DIVE_PIN_1(log, u35)
DIVE_PIN_1(log2, u10)
DIVE_PIN_1(log10, u10)
DIVE_PIN_1(log1p, u10)
DIVE_PIN_2(pow, u10)
DIVE_PIN_2(hypot, u35)
DIVE_PIN_1(cbrt, u10)
DIVE_PIN_1(erf, u10)
DIVE_PIN_1(erfc, u15)
DIVE_PIN_1(tgamma, u10)

// Compilers merge sin and cos of one argument into sincos, depending on the optimisation: the
// results are the same.
void sincos(double x, double* sine, double* cosine) noexcept {
  *sine = Sleef_cinz_sind1_u35purec(x);
  *cosine = Sleef_cinz_cosd1_u35purec(x);
}
void sincosf(float x, float* sine, float* cosine) noexcept {
  *sine = Sleef_cinz_sinf1_u35purec(x);
  *cosine = Sleef_cinz_cosf1_u35purec(x);
}

}  // extern "C"
// NOLINTEND
