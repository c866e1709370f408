/* The practical limit: the EKF of a coasting spacecraft, one member after another.

   The same formulas as navfilters': Runge-Kutta sub-steps, each with the exponential of the
   midpoint's Jacobian to third order, whose blocks are written out; Q at the interval's end; the
   angles between stars and the Earth's centre. Arrays are row by row: mean (members, 6) and cov
   (members, 6, 6), updated in place; z (steps, 2), R (2, 2), Q (6, 6), unit vectors stars (2, 3). */

#include "limit.h"

static void derivative(const flight *f, const double *x, double *dx)
{
    for (int i = 0; i < 3; i++)
        dx[i] = x[3 + i];
    acceleration(f, x, dx + 3);
}

/* F = I + hA + (hA)^2 / 2 + (hA)^3 / 6 for A = [0, I; G, 0]. */
static void transition(const flight *f, const double x[6], const double next[6], double F[6][6])
{
    double h = f->step, middle[3], G[3][3], G2[3][3];
    for (int i = 0; i < 3; i++)
        middle[i] = (x[i] + next[i]) / 2 + h / 8 * (x[3 + i] - next[3 + i]);
    gradient(f, middle, G);
    PRODUCT(3, 3, 3, G, G, G2)
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            F[i][j] = F[3 + i][3 + j] = (i == j) + h * h / 2 * G[i][j];
            F[i][3 + j] = h * ((i == j) + h * h / 6 * G[i][j]);
            F[3 + i][j] = h * (G[i][j] + h * h / 6 * G2[i][j]);
        }
}

static void predict(const flight *f, double x[6], double P[6][6], const double *Q)
{
    double before[6], F[6][6], Phi[6][6], whole[6][6];
    for (long k = 0; k < f->substeps; k++) {
        for (int i = 0; i < 6; i++)
            before[i] = x[i];
        runge_kutta(f, x, derivative);
        transition(f, before, x, F);
        if (k) {
            PRODUCT(6, 6, 6, F, Phi, whole)
        }
        for (int i = 0; i < 6; i++)
            for (int j = 0; j < 6; j++)
                Phi[i][j] = k ? whole[i][j] : F[i][j];
    }
    PRODUCT(6, 6, 6, Phi, P, whole)
    PRODUCT_T(6, 6, 6, whole, Phi, F)
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 6; j++)
            P[i][j] = (F[i][j] + F[j][i]) / 2 + Q[6 * i + j];
}

static void update(double x[6], double P[6][6], const double z[2], const double *R,
                   const double *stars)
{
    double r2 = dot(x, x), H[2][3], dz[2], P_xz[6][2], P_zz[2][2], K[6][2];
    for (int j = 0; j < 2; j++) {
        const double *u = stars + 3 * j;
        double w[3], towards[3], sine;
        cross(u, x, w);
        sine = sqrt(dot(w, w));
        dz[j] = z[j] - atan2(sine, -dot(u, x));
        cross(x, w, towards);
        for (int i = 0; i < 3; i++)
            H[j][i] = towards[i] / (r2 * sine);
    }
    for (int i = 0; i < 6; i++)
        for (int j = 0; j < 2; j++)
            P_xz[i][j] = dot(P[i], H[j]);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            P_zz[i][j] = R[2 * i + j] + H[i][0] * P_xz[0][j] + H[i][1] * P_xz[1][j]
                         + H[i][2] * P_xz[2][j];
    double a = P_zz[0][0], b = P_zz[0][1], c = P_zz[1][0], d = P_zz[1][1], det = a * d - b * c;
    for (int i = 0; i < 6; i++) {
        K[i][0] = (P_xz[i][0] * d - P_xz[i][1] * c) / det;
        K[i][1] = (P_xz[i][1] * a - P_xz[i][0] * b) / det;
        x[i] += K[i][0] * dz[0] + K[i][1] * dz[1];
    }
    for (int i = 0; i < 6; i++)
        for (int j = 0; j <= i; j++) {
            double one = K[i][0] * P_xz[j][0] + K[i][1] * P_xz[j][1];
            double other = K[j][0] * P_xz[i][0] + K[j][1] * P_xz[i][1];
            P[i][j] = P[j][i] = P[i][j] - (one + other) / 2;
        }
}

void orbit_ekf(long members, long steps, double *mean, double *cov, const double *z,
               const double *R, const double *Q, const double *stars, const flight *f)
{
    for (long i = 0; i < members; i++) {
        double *x = mean + 6 * i, (*P)[6] = (double (*)[6])(cov + 36 * i);
        for (long k = 0; k < steps; k++) {
            predict(f, x, P, Q);
            update(x, P, z + 2 * k, R, stars);
        }
    }
}
