/* Worst-case steps: how far rounding of its rows may move the unknowns of a block. See
 * kinfmu/solver/python/worst_case_step.py.
 */
#include "internal.h"

/* Return the largest of `most` and of |value| / scale. */
double kf_larger(double most, int count, const double *values, const double *scales)
{
    int k;
    for (k = 0; k < count; ++k) {
        most = fmax(most, fabs(values[k]) / scales[k]);
    }
    return most;
}

/* Return the first unknown of a block. */
int kf_first_of(int block)
{
    return block > 0 ? kf_block_ends[block - 1] : 0;
}

/* Form J^-1 (s R) of a block with the signs s that move the most sensitive unknown as far as possible; return false if J is
 * singular. rows: R, the scales of its rows.
 */
bool kf_worst_case_step(const kf_model *model, const kf_found *found, int block, const double *rows, double *step)
{
    double matrix[KF_ROOM(KF_LARGEST_BLOCK)], columns[KF_ROOM(KF_LARGEST_BLOCK)], unit[KF_ROOM(KF_LARGEST_BLOCK)];
    double factors[2 * KF_ROOM(KF_LARGEST_BLOCK) + KF_LU_ROOM(1)], determinant, farthest = -1.0;
    const int m = kf_block_rows[block], first = kf_first_of(block), k = kf_block_ends[block] - first;
    int i, j, worst = 0;
    kf_jacobian(model, found, block, matrix);
    if (m == 1 && k == 1) {
        columns[0] = rows[0] / matrix[0];
    } else if (KF_LARGEST_BLOCK >= 4 && m == 2 && k == 2) {
        const double det = matrix[0] * matrix[3] - matrix[1] * matrix[2];
        columns[0] = matrix[3] * (rows[0] / det);
        columns[1] = -matrix[2] * (rows[0] / det);
        columns[2] = -matrix[1] * (rows[1] / det);
        columns[3] = matrix[0] * (rows[1] / det);
    } else {
        if (!(m == k ? kf_lu(k, matrix, factors, &determinant) : kf_qr(m, k, matrix, factors, &determinant))) {
            return false;
        }
        for (i = 0; i < m; ++i) { /* columns of the inverse, or of the least-squares inverse if J is tall */
            for (j = 0; j < m; ++j) {
                unit[j] = i == j ? rows[i] : 0.0;
            }
            if (m == k) {
                kf_lu_solve(k, factors, unit, columns + i * k);
            } else {
                kf_qr_solve(m, k, factors, unit, columns + i * k);
            }
        }
    }
    for (j = 0; j < k; ++j) {
        double reach = 0.0;
        for (i = 0; i < m; ++i) {
            reach += fabs(columns[i * k + j]);
        }
        reach /= kf_unknown_scales[first + j];
        if (reach > farthest) {
            farthest = reach;
            worst = j;
        }
        step[j] = 0.0;
    }
    for (i = 0; i < m; ++i) {
        const double sign = columns[i * k + worst] >= 0.0 ? 1.0 : -1.0;
        for (j = 0; j < k; ++j) {
            step[j] += sign * columns[i * k + j];
        }
    }
    return true;
}

/* Return the error to which the rows of a block are known, relative to their scales. */
double kf_known_to(const kf_found *found, int block)
{
    const int first = kf_first_of(block), k = kf_block_ends[block] - first;
    const double largest = kf_larger(0.0, k, found->x + first, kf_unknown_scales + first);
    return KF_ROUNDINGS * KF_EPS * (1.0 + kf_row_offset) + found->residual + KF_EPS * largest;
}

/* Find the blocks whose worst-case steps are longest, the longest first, and the weight that makes up for the others in a sum
 * over them; return their number, -1 if a block is singular.
 */
int kf_worst_blocks(const kf_model *model, const kf_found *found, const bool *held, int *worst, double *weight)
{
    double step[KF_ROOM(KF_LARGEST_BLOCK)], farthest[KF_MOST_SOURCES];
    const double *rows = kf_row_scales;
    int block, all = 0, count = 0;
    for (block = 0; block < KF_BLOCKS; rows += kf_block_rows[block++]) {
        const int first = kf_first_of(block), k = kf_block_ends[block] - first;
        double moved;
        int place;
        if ((held != NULL && held[block]) || kf_is_outside(model, block)) {
            continue;
        }
        if (!kf_worst_case_step(model, found, block, rows, step)) {
            return -1;
        }
        moved = kf_known_to(found, block) * kf_larger(0.0, k, step, kf_unknown_scales + first);
        ++all;
        for (place = count; place > 0 && moved > farthest[place - 1]; --place) {
            if (place < KF_MOST_SOURCES) {
                farthest[place] = farthest[place - 1];
                worst[place] = worst[place - 1];
            }
        }
        if (place < KF_MOST_SOURCES) {
            farthest[place] = moved;
            worst[place] = block;
            count += count < KF_MOST_SOURCES ? 1 : 0;
        }
    }
    *weight = count > 0 ? sqrt((double)all / count) : 0.0;
    return count;
}

