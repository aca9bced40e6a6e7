/* Sizes of a model that is known at run time, with the most that there is room for: in place of a generated sizes.h. */
#ifndef KF_SIZES_H
#define KF_SIZES_H

#define KF_ROOM(n) KF_MOST_##n /* of KF_UNKNOWNS: KF_MOST_KF_UNKNOWNS */
#define KF_HAS(n) 1            /* there is code for all models */
#define KF_ASSIGN(to, from) _Generic((to), kf_pose *: assign_pose, kf_found *: assign_found)(to, from) /* of assign.h */

extern const int size_drivers, size_tracks, size_mixes, size_unknowns, size_coordinates, size_blocks, size_rows;
extern const int size_hold, size_outputs, size_watches, size_fixed, size_parameters, size_derived, size_constants;
extern const int size_distances, size_laws, size_law_arguments, size_law_lengths, size_tall, size_largest_block;

#define KF_DRIVERS size_drivers
#define KF_TRACKS size_tracks
#define KF_MIXES size_mixes
#define KF_UNKNOWNS size_unknowns
#define KF_COORDINATES size_coordinates
#define KF_BLOCKS size_blocks
#define KF_ROWS size_rows
#define KF_HOLD size_hold
#define KF_OUTPUTS size_outputs
#define KF_WATCHES size_watches
#define KF_FIXED size_fixed
#define KF_PARAMETERS size_parameters
#define KF_DERIVED size_derived
#define KF_CONSTANTS size_constants
#define KF_DISTANCES size_distances
#define KF_LAWS size_laws
#define KF_LAW_ARGUMENTS size_law_arguments
#define KF_LAW_LENGTHS size_law_lengths
#define KF_TALL size_tall
#define KF_LARGEST_BLOCK size_largest_block

#define KF_MOST_KF_DRIVERS 8
#define KF_MOST_KF_TRACKS 1
#define KF_MOST_KF_MIXES 1
#define KF_MOST_KF_UNKNOWNS 512
#define KF_MOST_KF_COORDINATES 1024
#define KF_MOST_KF_BLOCKS 512
#define KF_MOST_KF_ROWS 1024
#define KF_MOST_KF_HOLD 16384
#define KF_MOST_KF_OUTPUTS 2048
#define KF_MOST_KF_WATCHES 256
#define KF_MOST_KF_FIXED 1024
#define KF_MOST_KF_PARAMETERS 2048
#define KF_MOST_KF_DERIVED 4096
#define KF_MOST_KF_CONSTANTS 1024
#define KF_MOST_KF_DISTANCES 64
#define KF_MOST_KF_LAWS 256
#define KF_MOST_KF_LAW_ARGUMENTS 256
#define KF_MOST_KF_LAW_LENGTHS 256
#define KF_MOST_KF_TALL 1
#define KF_MOST_KF_LARGEST_BLOCK 10000

/* Of the solver, from those above. */
#define KF_MOST_KF_MAPS 5
#define KF_MOST_KF_BRIDGES (4 * KF_KEPT + 1)
#define KF_MOST_KF_SPANS (KF_KEPT + 8)
#define KF_MOST_KF_INTERVALS (KF_KEPT + KF_MOST_KF_BLOCKS)
#define KF_MOST_KF_POOLS KF_MOST_KF_DRIVERS

#endif
