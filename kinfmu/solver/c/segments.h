/* Segments: polynomials of the motion between nodes, by which samples are predicted.
 *
 * With one driver the motion is a function of the driver value, as far as the branch of the anchor reaches. Poses at equal
 * distances, the nodes, are followed from the anchor once. Three of them in a row are a segment: within it the polynomial
 * through values, slopes and curvatures of the unknowns predicts every sample. Around singular points, the windows of
 * bridges predict.
 *
 * If the driver is an angle, all angles occur in sines and cosines only, and the mechanism is after one turn as before but
 * for whole turns of its angles, the nodes of one turn serve all turns.
 */
#ifndef KF_SEGMENTS_H
#define KF_SEGMENTS_H

#include <stdint.h>

#include "follower.h"
#include "lanes.h"

#if defined(__AVX512DQ__) && !defined(__clang__)
#define KF_LOOKS_UP 1 /* two registers hold a number of each segment of a turn */
#else
#define KF_LOOKS_UP 0
#endif
#define KF_SEGMENTS 16     /* in a turn */
#define KF_TERMS 9         /* of a segment's polynomials: three nodes with three conditions */
#define KF_WINDOW_TERMS 12 /* of a window's: four nodes */
#define KF_WINDOWS 64      /* the first ones; samples in others are solved alone */
#define KF_FARTHEST 1e5    /* [rad, sizes]: lanes do not resolve the rounding of larger angles */

/* Unknowns are base + c[0] x + c[1] x^2 ... with x from -1 to 1, and x = 0 at the centre. sine, cosine: of the angles there,
 * that of the driver last. is_steep: the angle changes by more than pi/4.
 */
typedef struct {
    bool is_plain; /* all nodes are regular */
    double centre;
    double base[KF_ROOM(KF_UNKNOWNS)];
    double c[KF_TERMS - 1][KF_ROOM(KF_UNKNOWNS)];
    double sine[KF_UNKNOWNS + 1], cosine[KF_UNKNOWNS + 1];
    bool is_steep[KF_ROOM(KF_UNKNOWNS)];
} kf_segment;

/* Of a bridge: x = (u - centre) / half. held: blocks that are interpolated. */
typedef struct {
    double low, high, centre, half;
    double base[KF_ROOM(KF_UNKNOWNS)];
    double c[KF_WINDOW_TERMS - 1][KF_ROOM(KF_UNKNOWNS)];
    bool held[KF_ROOM(KF_BLOCKS)];
} kf_window;

/* From number `first` on, in steps of `width` from the anchor; those of one turn if the mechanism repeats; raised: turns by
 * which the unknowns grow in one turn.
 */
typedef struct {
    kf_segment *segments;
    int64_t first, count;
    double width;
    bool repeats, has_end; /* has_end: the last segment includes its end, where the last sample of a turn may be */
    double raised[KF_ROOM(KF_UNKNOWNS)];
    kf_window windows[KF_WINDOWS];
    int window_count;
#if KF_LOOKS_UP
    bool is_listed, is_plain; /* the segments of a turn, number by number; plain: all of them */
    double listed[KF_ROOM(KF_UNKNOWNS)][KF_TERMS + 2][KF_SEGMENTS], listed_driver[3][KF_SEGMENTS];
#endif
} kf_segments;

/* Compute segments for driver values (count) from the anchor of the follower's solver; false if there is no memory. */
bool kf_segments_lay(kf_segments *segments, kf_follower *follower, int64_t count, const double *u);
void kf_segments_free(kf_segments *segments);

/* Whole turns by which a driver value lies after the segments of the first one, if the mechanism repeats. */
double kf_turns_after(const kf_segments *segments, double u);

/* Predict samples at KF_LANES driver values; alone[i]: this one cannot be predicted. */
void kf_predict(const kf_segments *segments, const double *u, kf_lanes *lanes, int32_t *alone);

/* Positions in a window at driver values u of the first turn (KF_LANES), and turns after it; and the derivatives of what is
 * held for speeds and accelerations of the driver.
 */
void kf_window_read(const kf_segments *segments, const kf_window *window, const double *u, const double *turns,
                    kf_lanes *lanes);

#endif
