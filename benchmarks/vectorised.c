/* The limit with vector instructions: the same formulas as limit.c for many members at once.

   A block of members lies in arrays of its own, one for each element of mean and covariance, and goes
   through all steps in the cache. The compiler makes one instruction of several members: to be built
   with -O3 -march=native -ffast-math, which contracts a product and a sum into one rounding, reorders
   sums, and takes atan2 from the C library's vector mathematics (4 units in the last place). */

#include <math.h>

#define LANES 64

typedef struct { double x, y, xx, xy, yy; } state;
typedef struct { double r, b, rr, rb, bb, xr, xb, yr, yb; } moments;

static inline state update(state s, const double *z, moments m)
{
    double det = 1 / (m.rr * m.bb - m.rb * m.rb), dr = z[0] - m.r, db = z[1] - m.b;
    double K_xr = (m.xr * m.bb - m.xb * m.rb) * det, K_xb = (m.xb * m.rr - m.xr * m.rb) * det;
    double K_yr = (m.yr * m.bb - m.yb * m.rb) * det, K_yb = (m.yb * m.rr - m.yr * m.rb) * det;
    double xy = K_xr * m.yr + K_xb * m.yb, yx = K_yr * m.xr + K_yb * m.xb;
    return (state){s.x + K_xr * dr + K_xb * db, s.y + K_yr * dr + K_yb * db,
                   s.xx - (K_xr * m.xr + K_xb * m.xb), s.xy - (xy + yx) / 2,
                   s.yy - (K_yr * m.yr + K_yb * m.yb)};
}

static inline moments linearized(state s, const double *R)
{
    double r = sqrt(s.x * s.x + s.y * s.y), c = s.x / r, d = s.y / r, e = -d / r, f = c / r;
    moments m = {.r = r, .b = atan2(s.y, s.x)};
    m.xr = s.xx * c + s.xy * d, m.xb = s.xx * e + s.xy * f;
    m.yr = s.xy * c + s.yy * d, m.yb = s.xy * e + s.yy * f;
    m.rr = R[0] + c * m.xr + d * m.yr, m.rb = R[1] + c * m.xb + d * m.yb;
    m.bb = R[3] + e * m.xb + f * m.yb;
    return m;
}

static inline moments unscented(state s, const double *R)
{
    const double gamma = sqrt(3.0), W0 = 1.0 / 3 + 2, W = 0.5 / 3;
    double root = sqrt(s.xx), low = s.xy / root, rest = sqrt(s.yy - low * low);
    double dx[4] = {gamma * root, 0, -gamma * root, 0}, dr[4], db[4];
    double dy[4] = {gamma * low, gamma * rest, -gamma * low, -gamma * rest};
    double r = sqrt(s.x * s.x + s.y * s.y), b = atan2(s.y, s.x), sr = 0, sb = 0;
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        double p = s.x + dx[i], q = s.y + dy[i];
        dr[i] = sqrt(p * p + q * q) - r;
        db[i] = atan2(q, p) - b;
        sr += W * dr[i], sb += W * db[i];
    }
    moments m = {.r = r + sr, .b = b + sb, .rr = R[0] + W0 * sr * sr,
                 .rb = R[1] + W0 * sr * sb, .bb = R[3] + W0 * sb * sb};
#pragma GCC unroll 4
    for (int i = 0; i < 4; i++) {
        double er = dr[i] - sr, eb = db[i] - sb;
        m.rr += W * er * er, m.rb += W * er * eb, m.bb += W * eb * eb;
        m.xr += W * dx[i] * er, m.xb += W * dx[i] * eb;
        m.yr += W * dy[i] * er, m.yb += W * dy[i] * eb;
    }
    return m;
}

#define FILTER(name, predict)                                                                   \
    void name(long members, long steps, double *mean, double *cov, const double *z,            \
              const double *R)                                                                  \
    {                                                                                           \
        for (long first = 0; first < members; first += LANES) {                                 \
            long n = members - first < LANES ? members - first : LANES;                         \
            double *at = mean + 2 * first, *P = cov + 4 * first;                                \
            double x[LANES], y[LANES], xx[LANES], xy[LANES], yy[LANES];                         \
            for (long i = 0; i < LANES; i++) {                                                  \
                long j = i < n ? i : n - 1; /* the last one again, to fill the block */         \
                x[i] = at[2 * j], y[i] = at[2 * j + 1];                                         \
                xx[i] = P[4 * j], xy[i] = P[4 * j + 1], yy[i] = P[4 * j + 3];                   \
            }                                                                                   \
            for (long k = 0; k < steps; k++)                                                    \
                _Pragma("omp simd") for (int i = 0; i < LANES; i++) {                           \
                    state s = {x[i], y[i], xx[i], xy[i], yy[i]};                                \
                    s = update(s, z, predict(s, R));                                            \
                    x[i] = s.x, y[i] = s.y, xx[i] = s.xx, xy[i] = s.xy, yy[i] = s.yy;           \
                }                                                                               \
            for (long i = 0; i < n; i++) {                                                      \
                at[2 * i] = x[i], at[2 * i + 1] = y[i];                                         \
                P[4 * i] = xx[i], P[4 * i + 1] = P[4 * i + 2] = xy[i], P[4 * i + 3] = yy[i];    \
            }                                                                                   \
        }                                                                                       \
    }

FILTER(ekf, linearized)
FILTER(ukf, unscented)
