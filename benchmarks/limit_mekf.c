/* The practical limit: the multiplicative EKF on radar images, one member after another.

   The same formulas as navfilters': Runge-Kutta steps in the turning frame, P <- F P F^T + Q at each
   with F = I + hA + (hA)^2 / 2, without what is zero in F; the update in Joseph form. Arrays are row
   by row: mean (members, 9), whose last three are a rotation vector before and after all steps, and
   cov (members, 9, 9), updated in place; z (steps, 5): the pixel's position, slant range and speed;
   R (4, 4), D (3, 3), Q (9, 9) of one step, and axes (3, 3), the nominal T_b^s T_e^b. */

#include "limit.h"

static void derivative(const flight *f, const double *x, double *dx)
{
    double w = f->rate;
    for (int i = 0; i < 3; i++)
        dx[i] = x[3 + i];
    acceleration(f, x, dx + 3);
    dx[3] += w * (w * x[0] + 2 * x[4]);
    dx[4] += w * (w * x[1] - 2 * x[3]);
}

/* The first six rows and columns of F, for A = [0, I; B, C]. */
static void transition(const flight *f, const double x[6], const double next[6], double F[6][6])
{
    double h = f->step, w = f->rate, middle[3], B[3][3], CB[3][3];
    double C[3][3] = {{0, 2 * w, 0}, {-2 * w, 0, 0}, {0, 0, 0}}, C2[3][3];
    for (int i = 0; i < 3; i++)
        middle[i] = (x[i] + next[i]) / 2;
    gradient(f, middle, B);
    B[0][0] += w * w;
    B[1][1] += w * w;
    PRODUCT(3, 3, 3, C, B, CB)
    PRODUCT(3, 3, 3, C, C, C2)
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            F[i][j] = (i == j) + h * h / 2 * B[i][j];
            F[i][3 + j] = h * (i == j) + h * h / 2 * C[i][j];
            F[3 + i][j] = h * B[i][j] + h * h / 2 * CB[i][j];
            F[3 + i][3 + j] = (i == j) + h * C[i][j] + h * h / 2 * (B[i][j] + C2[i][j]);
        }
}

static void predict(const flight *f, double x[6], double P[9][9], const double *Q)
{
    double before[6], F[6][6], FP[6][9], FPF[6][6];
    for (long k = 0; k < f->substeps; k++) {
        for (int i = 0; i < 6; i++)
            before[i] = x[i];
        runge_kutta(f, x, derivative);
        transition(f, before, x, F);
        PRODUCT(6, 6, 9, F, P, FP)
        PRODUCT_T(6, 6, 6, FP, F, FPF)
        for (int i = 0; i < 6; i++) {
            for (int j = 0; j < 6; j++)
                P[i][j] = FPF[i][j];
            for (int j = 6; j < 9; j++)
                P[i][j] = P[j][i] = FP[i][j];
        }
        for (int i = 0; i < 9; i++)
            for (int j = 0; j < 9; j++)
                P[i][j] += Q[9 * i + j];
    }
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < i; j++)
            P[i][j] = P[j][i] = (P[i][j] + P[j][i]) / 2;
}

/* p (x) q, normalized: first q, then p. */
static void turn(const double p[4], double q[4])
{
    double w[3], s = p[3], t = q[3], size;
    cross(p, q, w);
    double scalar = s * t - dot(p, q);
    for (int i = 0; i < 3; i++)
        q[i] = s * q[i] + t * p[i] - w[i];
    q[3] = scalar;
    size = sqrt(dot(q, q) + scalar * scalar);
    for (int i = 0; i < 4; i++)
        q[i] /= size;
}

static void quaternion(const double theta[3], double q[4])
{
    double angle = sqrt(dot(theta, theta)), ratio = angle > 0 ? sin(angle / 2) / angle : 0.5;
    for (int i = 0; i < 3; i++)
        q[i] = ratio * theta[i];
    q[3] = cos(angle / 2);
}

static void rotation_vector(const double q[4], double theta[3])
{
    double sine = sqrt(dot(q, q)), ratio = sine > 0 ? 2 * atan2(sine, fabs(q[3])) / sine : 2;
    for (int i = 0; i < 3; i++)
        theta[i] = q[3] < 0 ? -ratio * q[i] : ratio * q[i];
}

/* T(q) times the nominal axes. */
static void antenna(const double q[4], const double *axes, double T[3][3])
{
    double s = q[3], scalar = s * s - dot(q, q);
    double skew[3][3] = {{0, -q[2], q[1]}, {q[2], 0, -q[0]}, {-q[1], q[0], 0}}, mu[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            mu[i][j] = scalar * (i == j) + 2 * q[i] * q[j] - 2 * s * skew[i][j];
    PRODUCT(3, 3, 3, mu, (const double (*)[3])axes, T)
}

/* K = P H^T S^-1 by the Cholesky factor of S, scaled to a unit diagonal. */
static void gain(double PHt[9][4], double S[4][4], double K[9][4])
{
    double scale[4], L[4][4];
    for (int j = 0; j < 4; j++)
        scale[j] = 1 / sqrt(S[j][j]);
    for (int j = 0; j < 4; j++)
        for (int i = j; i < 4; i++) {
            double rest = scale[i] * S[i][j] * scale[j];
            for (int k = 0; k < j; k++)
                rest -= L[i][k] * L[j][k];
            L[i][j] = i == j ? sqrt(rest) : rest / L[j][j];
        }
    for (int i = 0; i < 9; i++) {
        for (int j = 0; j < 4; j++) {
            double rest = PHt[i][j] * scale[j];
            for (int k = 0; k < j; k++)
                rest -= L[j][k] * K[i][k];
            K[i][j] = rest / L[j][j];
        }
        for (int j = 3; j >= 0; j--) {
            for (int k = j + 1; k < 4; k++)
                K[i][j] -= L[k][j] * K[i][k];
            K[i][j] /= L[j][j];
        }
        for (int j = 0; j < 4; j++)
            K[i][j] *= scale[j];
    }
}

static void update(double x[6], double q[4], double P[9][9], const double z[5], const double *R,
                   const double *D, const double *axes)
{
    double r_sf[3] = {z[0] - x[0], z[1] - x[1], z[2] - x[2]}, T[3][3], s[3];
    double distance = sqrt(dot(r_sf, r_sf)), speed = sqrt(dot(x + 3, x + 3));
    double H[4][9] = {{0}}, H_f[3][3], H_D[3][3], B[3][3], noise[4][4];
    antenna(q, axes, T);
    for (int i = 0; i < 3; i++)
        s[i] = dot(T[i], r_sf);
    double y[4] = {-s[0] / s[2], -s[1] / s[2], z[3] - distance, z[4] - speed};
    for (int i = 0; i < 2; i++) {
        double of_s[3] = {0, 0, -s[i] / (s[2] * s[2])}, of_mu[3];
        of_s[i] = 1 / s[2];
        for (int j = 0; j < 3; j++)
            H_f[i][j] = of_s[i] * T[i][j] + of_s[2] * T[2][j];
        cross(of_s, s, of_mu); /* of_s^T [s x] */
        for (int j = 0; j < 3; j++)
            H[i][6 + j] = of_mu[j];
    }
    for (int j = 0; j < 3; j++) {
        H_f[2][j] = r_sf[j] / distance;
        H[3][3 + j] = x[3 + j] / speed;
    }
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            H[i][j] = -H_f[i][j];
    PRODUCT(3, 3, 3, H_f, (const double (*)[3])D, H_D)
    PRODUCT_T(3, 3, 3, H_D, H_f, B)
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            noise[i][j] = R[4 * i + j] + (i < 3 && j < 3 ? B[i][j] : 0);

    double PHt[9][4], S[4][4], K[9][4], A[9][9], AP[9][9], KR[9][4], dx[9] = {0}, dq[4];
    PRODUCT_T(9, 9, 4, P, H, PHt)
    PRODUCT(4, 9, 4, H, PHt, S)
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            S[i][j] += noise[i][j];
    gain(PHt, S, K);
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 4; j++)
            dx[i] += K[i][j] * y[j];
    for (int i = 0; i < 6; i++)
        x[i] += dx[i];
    quaternion(dx + 6, dq);
    turn(dq, q);

    PRODUCT(9, 4, 9, K, H, A)
    for (int i = 0; i < 9; i++)
        for (int j = 0; j < 9; j++)
            A[i][j] = (i == j) - A[i][j];
    PRODUCT(9, 9, 9, A, P, AP)
    PRODUCT(9, 4, 4, K, noise, KR)
    for (int i = 0; i < 9; i++)
        for (int j = 0; j <= i; j++) {
            double sum = 0;
            for (int k = 0; k < 9; k++)
                sum += AP[i][k] * A[j][k];
            for (int k = 0; k < 4; k++)
                sum += KR[i][k] * K[j][k];
            P[i][j] = P[j][i] = sum;
        }
}

void mekf(long members, long steps, double *mean, double *cov, const double *z, const double *R,
          const double *D, const double *Q, const double *axes, const flight *f)
{
    for (long i = 0; i < members; i++) {
        double *x = mean + 9 * i, (*P)[9] = (double (*)[9])(cov + 81 * i), q[4];
        quaternion(x + 6, q);
        for (long k = 0; k < steps; k++) {
            predict(f, x, P, Q);
            update(x, q, P, z + 5 * k, R, D, axes);
        }
        rotation_vector(q, x + 6);
    }
}
