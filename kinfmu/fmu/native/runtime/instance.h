/* An FMU instance of a mechanism: what FMI 2.0 and FMI 3.0 have in common. fmi2.c and fmi3.c are thin layers over it.
 *
 * The protocol is that of the python flavour (kinfmu/fmu/slave/slave.py): a set marks; a get solves from the *committed* pose
 * and caches; a step (in model exchange: a completed integrator step) commits the pose. Trial values never influence a
 * result, so a host may go back in time.
 */
#ifndef KF_INSTANCE_H
#define KF_INSTANCE_H

#include "interface.h"
#include "solver.h"

#define KF_INPUT_ORDERS 3 /* derivatives of an input that a step may follow */
#define KF_NO_STATES "there are no continuous states and no event indicators"

/* Numbered as fmi2Status and fmi3Status are. */
typedef enum { KF_DONE, KF_WARN, KF_DISCARD, KF_ERROR } kf_answer;

typedef enum {
    KF_INSTANTIATED,
    KF_INITIALIZATION,
    KF_STEPPING,
    KF_EVENTS_OF_STEPS, /* event mode of co-simulation, if the host uses it */
    KF_EVENTS,
    KF_CONTINUOUS,
    KF_TERMINATED
} kf_mode;

/* Calls that are possible in some modes only. */
typedef enum {
    KF_SET_UP,
    KF_EXIT_INITIALIZATION,
    KF_SET_VARIABLES,
    KF_DO_STEP,
    KF_ENTER_EVENTS_OF_STEPS,
    KF_ENTER_STEPS,
    KF_ENTER_EVENTS,
    KF_ENTER_CONTINUOUS,
    KF_SET_TIME,
    KF_SET_STATES,
    KF_COMPLETE_STEP,
    KF_TERMINATE
} kf_call;

/* Source of a driver's rate: an estimate, its own input, or a given derivative of the driver's value or speed. */
typedef enum { KF_RATE_ESTIMATED, KF_RATE_INPUT, KF_RATE_OF_VALUE, KF_RATE_OF_SPEED } kf_rate_source;

/* Number of drivers' rates that are given, not estimated. */
typedef enum { KF_NO_RATES, KF_SOME_RATES, KF_ALL_RATES } kf_given_rates;

/* A communication point and the driver values there. */
typedef struct {
    double t;
    double u[KF_DRIVERS];
} kf_sample;

/* All that a result depends on, and the results known so far: plain data, so that the state of an FMU is a copy of it.
 *
 * `real` holds the Real variables by their place in the list; a bit of `known` is set if those of a part are up to date.
 */
typedef struct {
    kf_pose poses[2];
    int committed, asked; /* indices of poses; equal if the requested pose is the committed one */
    bool solved;          /* poses[asked] is the requested pose */
    kf_status status, committed_status;
    int work;      /* pose solves of the requested pose */
    int most_work; /* the parameter; 0: no limit */
    char message[KF_MESSAGE]; /* why the requested pose is unreachable */
    unsigned known;
    bool drive_known;
    double u[KF_DRIVERS], ud[KF_DRIVERS], udd[KF_DRIVERS]; /* values, speeds and accelerations of the drivers of the pose shown */
    double real[KF_REALS];
    kf_mode mode;
    bool model_exchange, driven_by_time;
    int rates; /* the parameter: KF_RATES_AUTO, _ESTIMATED or _WIRED */
    bool unbound; /* parameters were set and not yet bound */
    bool unsolvable; /* they have no solution */
    double time;  /* the communication point, or the point that a failed step asked for */
    bool touched; /* something was set since the last commit */
    bool ahead;   /* requested is the end of a failed step, not the values set */
    unsigned stray;         /* value reference of an input that was set, 0 if none was */
    bool stray_warned;        /* the host was warned that an input has no effect while time drives */
    bool wired[3 * KF_DRIVERS]; /* rates seen other than 0 */
    unsigned char sources[3 * KF_DRIVERS]; /* kf_rate_source of each rate */
    kf_given_rates given; /* how many of them are not estimated */
    bool moving;                /* derivatives of inputs were given for the next step */
    bool ended;                 /* the committed pose is the end of a step that followed derivatives of inputs */
    unsigned char orders[3 * KF_DRIVERS]; /* highest order of the derivatives given of each input, 0 if none */
    double input_rates[KF_INPUTS][KF_INPUT_ORDERS];
    double ended_step, ended_ud[KF_DRIVERS], ended_udd[KF_DRIVERS]; /* of the step that ended so: its size, the rates at its end */
    double committed_u[KF_DRIVERS], committed_inputs[3 * KF_DRIVERS];
    double committed_efforts[KF_ROOM(KF_LOADS)]; /* of external loads, and constants of the laws of loads */
    int samples;
    kf_sample history[KF_SAMPLES]; /* the last commits, oldest first */
    bool failed, terminated;
    double failed_time, failed_step, last_time;
    double start_time, stop_time; /* of the experiment; the stop time is DBL_MAX if none was given */
    double step_size; /* that the integrator would take next, 0 at the start */
    kf_status held_status; /* discrete variables of model exchange, which stay between events */
    int held_iterations, held_work;
    char held_message[KF_MESSAGE];
    kf_solver solver; /* the last: what it needs for a call only is not copied */
} kf_state;

#define KF_STATE_SIZE (offsetof(kf_state, solver) + KF_SOLVER_STATE)

/* The list of variables read last, and the parts that they belong to: hosts read the same list again and again. */
#define KF_LISTED 96
typedef struct {
    size_t count;
    unsigned parts;
    unsigned references[KF_LISTED];
} kf_list;

typedef void (*kf_send)(const void *host, kf_answer answer, const char *category, const char *message);

typedef struct {
    kf_state now;
    kf_send send;     /* passes messages to the host, with `host` as its argument */
    const void *host;
    bool silent;
    bool has_event_mode, returns_early; /* the host uses event mode in co-simulation; steps may end before they should */
    unsigned muted; /* one bit for each category */
    kf_list list;
    kf_pose track[2]; /* of the integrator */
    void (*update)(const void *host, double time); /* asks the host for the inputs at a time in its step; NULL: it gives none */
    bool updating; /* the host is asked: only efforts and external loads may be set */
    double seed[KF_REALS], slope[KF_REALS], total[KF_REALS], trial[KF_REALS]; /* of directional derivatives */
} kf_instance;

#define KF_LONGEST (KF_MESSAGE + 120) /* bytes of a message with its context */

/* Messages: `kf_answered` formats one, passes it to the host and returns `answer`. */
extern const char *const kf_categories[3];
KF_RARE kf_answer kf_answered(const kf_instance *instance, kf_answer answer, const char *format, ...);
KF_RARE kf_answer kf_no_array(const kf_instance *instance, size_t count);
kf_answer kf_set_logging(kf_instance *instance, bool on, size_t count, const char *const *categories);

/* Life. kf_start: as freshly instantiated. */
bool kf_token_fits(const char *token);
void kf_start(kf_instance *instance, bool model_exchange);
kf_answer kf_set_experiment(kf_instance *instance, double start_time, bool has_stop_time, double stop_time);
kf_answer kf_enter_initialization(kf_instance *instance);
kf_answer kf_exit_initialization(kf_instance *instance);
kf_answer kf_step(kf_instance *instance, double time, double step);
kf_answer kf_set_time(kf_instance *instance, double time);
kf_answer kf_complete_integrator_step(kf_instance *instance, bool *wants_event);
bool kf_next_event(const kf_instance *instance, double *time);
kf_answer kf_enter_events(kf_instance *instance);
kf_answer kf_step_to_event(kf_instance *instance, double time, double step, bool *has_event, bool *is_early);
kf_answer kf_enter(kf_instance *instance, kf_mode mode, kf_call call);
kf_answer kf_possible(const kf_instance *instance, kf_call call); /* or Error, with a message */

/* Variables, by value references: the place in the list, counted from 1 as FMI 2.0 counts the places of variables. So the
 * reference 0 belongs to no variable; as a place it wraps round and is past the end.
 */
#define KF_PLACE(reference) ((reference) - 1u)
kf_answer kf_get_real(kf_instance *instance, const unsigned *references, size_t count, double *values);
kf_answer kf_set_real(kf_instance *instance, const unsigned *references, size_t count, const double *values);
kf_answer kf_get_count(kf_instance *instance, unsigned reference, const char *type, long long *value);
kf_answer kf_set_count(kf_instance *instance, unsigned reference, const char *type, long long value);
kf_answer kf_get_boolean(kf_instance *instance, unsigned reference, bool *value);
kf_answer kf_set_boolean(kf_instance *instance, unsigned reference, bool value);
kf_answer kf_get_string(kf_instance *instance, unsigned reference, const char **value);
KF_RARE kf_answer kf_not_a(const kf_instance *instance, unsigned reference, const char *type);
KF_RARE kf_answer kf_not_settable(const kf_instance *instance, unsigned reference, const char *type);
const char *kf_name_of(unsigned reference);

/* Derivatives. */
kf_answer kf_directional(kf_instance *instance, const unsigned *unknowns, size_t unknown_count, const unsigned *knowns,
                         size_t known_count, const double *seed, double *sensitivity);
kf_answer kf_output_derivative(kf_instance *instance, unsigned reference, int order, double *value);
kf_answer kf_set_input_derivative(kf_instance *instance, unsigned reference, int order, double value);

/* States. */
kf_answer kf_copy_state(kf_instance *instance, void **state);
kf_answer kf_restore_state(kf_instance *instance, const void *state);
size_t kf_serialized_size(void);
kf_answer kf_serialize(kf_instance *instance, const void *state, unsigned char *bytes, size_t size);
kf_answer kf_deserialize(kf_instance *instance, const unsigned char *bytes, size_t size, void **state);

/* Shared by the files of the instance. */
#define KF_BIT(part) (1u << (part))
#define KF_FORCE_PARTS (KF_BIT(KF_PART_FORCES) | KF_BIT(KF_PART_REACTIONS) | KF_BIT(KF_PART_SHAKING))
#define KF_POSE_PARTS                                                                                                  \
    (KF_BIT(KF_PART_VALUES) | KF_BIT(KF_PART_RATES) | KF_BIT(KF_PART_ACCELERATIONS) | KF_BIT(KF_PART_ERRORS) |          \
     KF_BIT(KF_PART_WATCH) | KF_FORCE_PARTS)
#define KF_GIVEN_PARTS                                                                                                 \
    (KF_BIT(KF_PART_MOVERS) | KF_BIT(KF_PART_CONSTANTS) | KF_BIT(KF_PART_PARAMETERS) | KF_BIT(KF_PART_TOLERANCE) |      \
     KF_BIT(KF_PART_LOADS))
#define KF_REAL(state, part) ((state)->real + kf_part_first[part])

/* Generated, where their part has variables: the forces of one sample. */
typedef void kf_stage(double time, const double *u, const double *ud, const double *udd, const double *z,
                      const double *zd, const double *zdd, const double *slopes, const double *efforts,
                      const double *parameters, double *forces);
kf_stage kf_forces, kf_reactions, kf_shaking, kf_distances;
extern const char *const kf_meeting[]; /* generated: messages where a distance is 0 */
void kf_warn_of_meeting(kf_instance *instance, unsigned parts);
void kf_forces_at(const kf_solver *solver, kf_pose *pose, double t, const double *const drive[3], const double *efforts,
                  unsigned parts, double *row);
void kf_read_forces(kf_state *state, unsigned parts);
void kf_forces_of_trial(kf_state *state, const kf_solver *solver, kf_pose *pose, const double *const drive[3],
                        unsigned parts, double *row);
double kf_step_along_laws(const double *loads, const double *seed, double longest);
void kf_add_force_slopes(kf_state *state, const double *dv, const double *da, const double *loads, double dt,
                         unsigned parts, double *slope);
void kf_forget(kf_state *state);        /* the driver values may have changed */
void kf_forget_motion(kf_state *state); /* the rates may have changed */
bool kf_holds(const kf_state *state);    /* discrete variables keep their values */
kf_status kf_ask_anew(kf_instance *instance);
kf_pose *kf_shown(kf_state *state);
KF_RARE kf_answer kf_bind_parameters(kf_instance *instance);
void kf_solve_at(kf_state *state, const double *u);
void kf_commit_pose(kf_state *state);
void kf_commit(kf_state *state, double t, double step);
kf_answer kf_discarded(kf_instance *instance, double time, double step, double at);
bool kf_is_past_stop(const kf_state *state, double time, double step);
KF_RARE kf_answer kf_past_stop(const kf_instance *instance, const char *function, double time, double step);
kf_answer kf_read(kf_instance *instance, unsigned parts);
void kf_find_drive(kf_state *state);
/* Times at which drivers jump, and periods after which they jump again, 0 if they do not: events.c. */
void kf_jumps(const kf_model *model, const double *constants, double *jumps, double *periods);
void kf_touch(kf_state *state); /* a variable is set: values shown are those at the current time, not at the commit */
void kf_bound_errors(double errors[3]);
double kf_moment(const kf_state *state, double *t, double *u);
void kf_find_errors(kf_state *state, double errors[3]);

/* Central differences of sixth order: f' = sum of kf_sixth_order[j - 1] (f(j h) - f(-j h)) / h, j = 1, 2, 3. */
#define KF_TRIAL 2e-3 /* [rad, sizes], far from singular points: rounding and truncation errors are both near 1e-13 */
#define KF_TRIES 12   /* halvings of the step where a trial has no solution */
extern const double kf_sixth_order[3];
double kf_largest_rate(const double *v);
double kf_trial_step(kf_state *state);

/* Return whether numbers are rounded to nearest: sines and cosines, among others, rely on it. */
static inline bool kf_rounds_to_nearest(void)
{
    static const volatile double small = 1e-40; /* volatile: added when the program runs */
    const double added = small;
    return 1.0 + added == 1.0 - added;
}

/* Return whether a call has valid arguments: an instance, and arrays that are not NULL. */
static inline kf_answer kf_check(const kf_instance *instance, const void *references, const void *values, size_t count)
{
    if (instance == NULL) {
        return KF_ERROR;
    }
    return references == NULL || values == NULL ? kf_no_array(instance, count) : KF_DONE;
}

/* Return whether a variable can be set: the acceleration of a state is computed. */
static inline bool kf_is_given(unsigned place)
{
    return place < KF_REALS && (KF_BIT(kf_part_of[place]) & (KF_GIVEN_PARTS | KF_BIT(KF_PART_INPUTS))) != 0 &&
           !(KF_STATES && kf_part_of[place] == KF_PART_INPUTS && place % 3 == 2);
}

/* Return the number of an input whose derivatives a step can follow, -1 for any other variable. */
static inline int kf_followed(unsigned place)
{
    const int part = place < KF_REALS ? kf_part_of[place] : KF_PARTS;
    const int number = place < KF_REALS ? (int)place - kf_part_first[part] : 0;
    if (part == KF_PART_MOVERS) {
        return number;
    }
    return KF_STATES && part == KF_PART_LOADS && number < KF_LOAD_INPUTS ? KF_DRIVERS + number : -1;
}

/* Solve for the requested pose; it may be good or not. */
static inline kf_status kf_ask(kf_instance *instance)
{
    return instance->now.solved ? instance->now.status : kf_ask_anew(instance);
}

#include "motion.h"

#endif
