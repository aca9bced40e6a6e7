/* What a specialist would write for a four-bar by hand, and the compiler vectorizes: the fastest known way.
 *
 *     P = a (cos u, sin u),   d = (g, 0) - P,   Q - P = e d + h d_turned_left
 *     e = (b^2 - c^2 + d.d) / (2 d.d),   h^2 = b^2 / d.d - e^2
 *
 * and rates and accelerations from the derivatives of the loop. No check, no branch but the one chosen, no change point.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "sincos.h"

static inline double arctan2(double y, double x)
{
    /* fdlibm's polynomial, after the angle is brought into -pi/8 .. pi/8 */
    const double ax = fabs(x), ay = fabs(y);
    const bool steep = ay > ax;
    const double t = (steep ? ax : ay) / (steep ? ay : ax);
    const bool large = t > 0.41421356237309503;
    const double r = large ? (t - 1.0) / (t + 1.0) : t;
    const double z = r * r, w = z * z;
    const double odd = z * (3.33333333333329318027e-01 + w * (1.42857142725034663711e-01 + w * (9.09088713343650656196e-02
        + w * (6.66107313738753120669e-02 + w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
    const double even = w * (-1.99999999998764832476e-01 + w * (-1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02
        + w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
    double angle = r - r * (odd + even);
    angle = large ? 0.78539816339744830962 + angle : angle;
    angle = steep ? 1.57079632679489661923 - angle : angle;
    angle = x < 0.0 ? 3.14159265358979323846 - angle : angle;
    return y < 0.0 ? -angle : angle;
}

/* columns: 15 of `count` numbers: crank.phi, coupler.x, coupler.y, coupler.phi, rocker.phi, their rates, accelerations. */
void closed_form(int64_t count, const double *restrict u, const double *restrict ud, const double *restrict udd, double g,
                 double a, double b, double c, double *restrict columns)
{
    int64_t i;
#pragma GCC ivdep
    for (i = 0; i < count; ++i) {
        double s, k, dx, dy, square, e, h, qx, qy, rx, ry, det, wx, wy, w2, w3, ax, ay, v = ud[i];
        kf_sincos_lane(u[i], &s, &k);
        s *= a;
        k *= a;
        dx = g - k;
        dy = -s;
        square = dx * dx + dy * dy;
        e = 0.5 + 0.5 * (b * b - c * c) / square;
        h = sqrt(b * b / square - e * e);
        qx = e * dx - h * dy; /* of the coupler */
        qy = e * dy + h * dx;
        rx = qx - dx; /* of the rocker */
        ry = qy - dy;
        det = 1.0 / (qx * ry - qy * rx);
        wx = s * v; /* velocity of P and what the links add: (-qy w2, qx w2) - (-ry w3, rx w3) = (wx, wy) */
        wy = -k * v;
        w2 = (wx * rx + wy * ry) * det;
        w3 = (wx * qx + wy * qy) * det;
        ax = k * v * v + s * udd[i] + qx * w2 * w2 - rx * w3 * w3;
        ay = s * v * v - k * udd[i] + qy * w2 * w2 - ry * w3 * w3;
        columns[i] = u[i];
        columns[count + i] = k;
        columns[2 * count + i] = s;
        columns[3 * count + i] = arctan2(qy, qx);
        columns[4 * count + i] = arctan2(ry, rx);
        columns[5 * count + i] = v;
        columns[6 * count + i] = -s * v;
        columns[7 * count + i] = k * v;
        columns[8 * count + i] = w2;
        columns[9 * count + i] = w3;
        columns[10 * count + i] = udd[i];
        columns[11 * count + i] = -k * v * v - s * udd[i];
        columns[12 * count + i] = -s * v * v + k * udd[i];
        columns[13 * count + i] = (ax * rx + ay * ry) * det;
        columns[14 * count + i] = (ax * qx + ay * qy) * det;
    }
}

/* What no formula can be faster than: the same numbers are read, and as many are stored. */
void stores(int64_t count, const double *restrict u, const double *restrict ud, const double *restrict udd,
            double *restrict columns)
{
    int64_t i, k;
    for (i = 0; i < count; ++i) {
        for (k = 0; k < 5; ++k) {
            columns[k * count + i] = u[i];
            columns[(5 + k) * count + i] = ud[i];
            columns[(10 + k) * count + i] = udd[i];
        }
    }
}
