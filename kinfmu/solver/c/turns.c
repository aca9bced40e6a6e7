/* Whole turns: angles moved by multiples of 2 pi without a loss of digits. See kinfmu/solver/python/turns.py. */
#include "internal.h"

#define TURN 6.283185307179586       /* [rad]; for counting */
#define HIGH 6.2831853069365025      /* [rad]; 2 pi to 32 bits: its multiples by up to 2^21 turns are exact */
#define LOW 2.430840202602477e-10    /* [rad]; the rest */

/* angle + turns * 2 pi [rad], rounded about once. */
double kf_turned(double angle, double turns)
{
    return angle + turns * HIGH + turns * LOW;
}

/* The whole number of turns nearest to an angle [rad]. */
double kf_whole_turns(double angle)
{
    return nearbyint(angle / TURN);
}
