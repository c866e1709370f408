/* The practical limit: one range-bearing update after another, each member's state in registers.

   The same formulas as navfilters': linearized or unscented moments (alpha 1, beta 2, kappa 1),
   gain by the adjugate, the symmetric part of the covariance's reduction. Arrays are row by row:
   mean (members, 2) and cov (members, 2, 2), updated in place; z (2), R (2, 2). */

#include <math.h>

typedef struct { double z[2], P_zz[2][2], P_xz[2][2]; } moments;

static void update(double x[2], double P[2][2], const double z[2], const moments *m)
{
    double a = m->P_zz[0][0], b = m->P_zz[0][1], c = m->P_zz[1][0], d = m->P_zz[1][1];
    double det = a * d - b * c, dz[2] = {z[0] - m->z[0], z[1] - m->z[1]}, K[2][2], D[2][2];
    for (int i = 0; i < 2; i++) {
        K[i][0] = (m->P_xz[i][0] * d - m->P_xz[i][1] * c) / det;
        K[i][1] = (m->P_xz[i][1] * a - m->P_xz[i][0] * b) / det;
        x[i] += K[i][0] * dz[0] + K[i][1] * dz[1];
    }
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            D[i][j] = K[i][0] * m->P_xz[j][0] + K[i][1] * m->P_xz[j][1];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            P[i][j] -= (D[i][j] + D[j][i]) / 2;
}

static void linearized(const double x[2], double P[2][2], const double *R, moments *m)
{
    double r = hypot(x[0], x[1]), c = x[0] / r, s = x[1] / r;
    double H[2][2] = {{c, s}, {-s / r, c / r}};
    m->z[0] = r;
    m->z[1] = atan2(x[1], x[0]);
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            m->P_xz[i][j] = P[i][0] * H[j][0] + P[i][1] * H[j][1];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            m->P_zz[i][j] = R[2 * i + j] + H[i][0] * m->P_xz[0][j] + H[i][1] * m->P_xz[1][j];
}

static void unscented(const double x[2], double P[2][2], const double *R, moments *m)
{
    const double gamma = sqrt(3.0), W0 = 1.0 / 3 + 2, W = 0.5 / 3;
    double L00 = sqrt(P[0][0]), L10 = P[1][0] / L00, L11 = sqrt(P[1][1] - L10 * L10);
    double dx[4][2] = {{gamma * L00, gamma * L10}, {0, gamma * L11}};
    double z0[2] = {hypot(x[0], x[1]), atan2(x[1], x[0])}, dz[4][2], shift[2] = {0, 0};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++)
            dx[2 + i][j] = -dx[i][j];
    for (int i = 0; i < 4; i++) {
        double p = x[0] + dx[i][0], q = x[1] + dx[i][1];
        dz[i][0] = hypot(p, q) - z0[0];
        dz[i][1] = atan2(q, p) - z0[1];
        shift[0] += W * dz[i][0];
        shift[1] += W * dz[i][1];
    }
    for (int i = 0; i < 2; i++) {
        m->z[i] = z0[i] + shift[i];
        for (int j = 0; j < 2; j++) {
            double P_zz = R[2 * i + j] + W0 * shift[i] * shift[j], P_xz = 0;
            for (int k = 0; k < 4; k++) {
                P_zz += W * (dz[k][i] - shift[i]) * (dz[k][j] - shift[j]);
                P_xz += W * dx[k][i] * (dz[k][j] - shift[j]);
            }
            m->P_zz[i][j] = P_zz;
            m->P_xz[i][j] = P_xz;
        }
    }
}

#define FILTER(name, predict)                                                                  \
    void name(long members, long steps, double *mean, double *cov, const double *z,           \
              const double *R)                                                                 \
    {                                                                                          \
        for (long i = 0; i < members; i++) {                                                   \
            double x[2] = {mean[2 * i], mean[2 * i + 1]};                                      \
            double P[2][2] = {{cov[4 * i], cov[4 * i + 1]}, {cov[4 * i + 2], cov[4 * i + 3]}}; \
            for (long k = 0; k < steps; k++) {                                                 \
                moments m;                                                                     \
                predict(x, P, R, &m);                                                          \
                update(x, P, z, &m);                                                           \
            }                                                                                  \
            for (int j = 0; j < 2; j++)                                                        \
                mean[2 * i + j] = x[j];                                                        \
            for (int j = 0; j < 4; j++)                                                        \
                cov[4 * i + j] = P[j / 2][j % 2];                                              \
        }                                                                                      \
    }

FILTER(ekf, linearized)
FILTER(ukf, unscented)
