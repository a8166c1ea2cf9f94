/* Frontal-plane kinematics of TALOS in closed form, in Pinocchio's order and conventions. */
#ifndef BALANCE_TALOS_H
#define BALANCE_TALOS_H

enum { TALOS_NQ = 39, TALOS_NV = 38 };

#define TALOS_MASS 90.272192         /* kg, talos_reduced.urdf */
#define TALOS_COM_HEIGHT 0.87668     /* m above the soles in half_sitting */
#define TALOS_HALF_STANCE 0.085      /* m, hip-roll axis and sole from the middle */
#define TALOS_ANKLE 0.107            /* m, ankle above the sole */
#define TALOS_HIP 0.27105            /* m, hip-roll axis below base_link */
#define TALOS_ARM_START 0.173046     /* rad, abduction in half_sitting */
#define TALOS_ARM_MASS 8.029481      /* kg, from the shoulder's abduction axis on */
#define TALOS_ARM_LEVER 0.3384       /* m, its centre below that axis */
#define TALOS_ARM_INERTIA 1.2532     /* kg m2 about that axis, mean of both arms */
#define TALOS_ARM_TORQUE 22.32       /* N m, effort limit of arm_*_2_joint */

/* Coordinates of the standing robot: CoM y (m), trunk roll about +x (rad), feet y (m), feet lifted by (m), arms abducted by
 * (rad). The CoM stays at TALOS_COM_HEIGHT. */
enum { C_Y, C_ROLL, C_LEFT, C_RIGHT, C_LIFT_LEFT, C_LIFT_RIGHT, C_ARM_LEFT, C_ARM_RIGHT, C_SIZE };

/* q of the standing robot, soles flat. */
void talos_standing(const double c[C_SIZE], double q[TALOS_NQ]);

/* Coordinates of the falling robot: turned about the edge since the fall began (rad, about +x), trunk roll (rad), length of
 * the line from edge to hips over its length then (1), arms. */
enum { F_TURN, F_ROLL, F_LENGTH, F_ARM_LEFT, F_ARM_RIGHT, F_SIZE };

/* q of the falling robot: from q at the start of the fall, it turns about the point (edge_y, 0); side +1 falls to +y. */
void talos_falling(const double start[TALOS_NQ], double edge_y, double side, const double f[F_SIZE], double q[TALOS_NQ]);

/* CoM of the robot in the world (x, y, z) for a q of one of the above. */
void talos_com(const double q[TALOS_NQ], double com[3]);

#endif
