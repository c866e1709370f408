/* What the two loops in motion share: the pull of an oblate Earth, a Runge-Kutta step, products. */

#include <math.h>

/* Gravity: mu and k = 3/2 J2 R_e^2; the frame's rotation, rad/s; the steps of an interval. */
typedef struct { double mu, k, rate, step; long substeps; } flight;

static inline double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross(const double a[3], const double b[3], double c[3])
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void acceleration(const flight *f, const double r[3], double a[3])
{
    double s = 1 / dot(r, r), k = f->k * s, size = -f->mu * s * sqrt(s);
    double along = 1 + k * (1 - 5 * s * r[2] * r[2]);
    for (int i = 0; i < 3; i++)
        a[i] = size * along * r[i];
    a[2] += size * 2 * k * r[2];
}

static inline void gradient(const flight *f, const double r[3], double G[3][3])
{
    double s = 1 / dot(r, r), root = sqrt(s), k = f->k * s, size = f->mu * s * root;
    double u[3] = {r[0] * root, r[1] * root, r[2] * root}, c = u[2];
    double of_u = size * (3 + k * (5 - 35 * c * c)), of_I = size * (k * (5 * c * c - 1) - 1);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            G[i][j] = of_u * u[i] * u[j] + (i == j) * of_I;
    for (int i = 0; i < 3; i++) {
        double of_n = size * k * (10 * c * u[i] - (i == 2));
        G[i][2] += of_n;
        G[2][i] += of_n;
    }
}

static inline void runge_kutta(const flight *f, double x[6],
                               void (*derivative)(const flight *, const double *, double *))
{
    double h = f->step, k1[6], k2[6], k3[6], k4[6], at[6];
    derivative(f, x, k1);
    for (int i = 0; i < 6; i++)
        at[i] = x[i] + h / 2 * k1[i];
    derivative(f, at, k2);
    for (int i = 0; i < 6; i++)
        at[i] = x[i] + h / 2 * k2[i];
    derivative(f, at, k3);
    for (int i = 0; i < 6; i++)
        at[i] = x[i] + h * k3[i];
    derivative(f, at, k4);
    for (int i = 0; i < 6; i++)
        x[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
}

/* C = A B, and C = A B^T, for matrices that are whole: (n, m) times (m, p), row by row. */
#define PRODUCT(n, m, p, A, B, C)                                                              \
    for (int i_ = 0; i_ < (n); i_++) {                                                         \
        for (int j_ = 0; j_ < (p); j_++)                                                       \
            (C)[i_][j_] = 0;                                                                   \
        for (int k_ = 0; k_ < (m); k_++)                                                       \
            for (int j_ = 0; j_ < (p); j_++)                                                   \
                (C)[i_][j_] += (A)[i_][k_] * (B)[k_][j_];                                      \
    }

#define PRODUCT_T(n, m, p, A, B, C)                                                            \
    for (int i_ = 0; i_ < (n); i_++) {                                                         \
        for (int j_ = 0; j_ < (p); j_++)                                                       \
            (C)[i_][j_] = 0;                                                                   \
        for (int k_ = 0; k_ < (m); k_++)                                                       \
            for (int j_ = 0; j_ < (p); j_++)                                                   \
                (C)[i_][j_] += (A)[i_][k_] * (B)[j_][k_];                                      \
    }
