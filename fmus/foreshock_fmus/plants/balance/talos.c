/* TALOS: lumped link masses, closed-form leg inverse kinematics. Constants from talos_reduced.urdf (example-robot-data)
 * in the posture half_sitting of talos.srdf; tests hold them against Pinocchio. */
#include "talos.h"

#include <math.h>
#include <string.h>

#define THIGH 0.38
#define SHANK 0.325
#define ANKLE_X 0.0111530535 /* ankle ahead of the hip in half_sitting: thigh and shank at -0.411354 and 0.448041 rad */
#define REACH (THIGH + SHANK - 1e-4)

typedef struct { double m, x, y, z; } Lump; /* y of the left side; the right is its mirror image unless given */

/* pelvis, torso, head, hip-yaw and first shoulder links, in base_link */
static const Lump trunk = {42.83525, -0.04632639348822298, 0.0024329395089324785, 0.10594175317148591};
static const Lump hip2 = {2.37607, 0.01583, -0.00021, 0.00619}, thigh = {6.82734, 0.00658, 0.06563, -0.17278};
static const Lump shank = {3.63668, 0.0152, 0.02331, -0.12063}, ankle5 = {1.24433, -0.01106, 0.04708, 0.05271};
static const Lump foot = {1.60457, -0.020739934001009618, -0.0001888158821366472, -0.060879236368622115};
static const Lump arm[2] = {{8.029481, 0.0754611103189341, 0.001486739292467107, -0.3381845980537815},
                            {8.029481, 0.07448509226946422, -0.00043909283217191675, -0.33862668146117575}};
static const double shoulder[3] = {-0.02823822481886323, 0.2907258838429018, 0.351127292198804};
static const double shoulder_axes[9] = {0.9667600838500826,    -0.2555958330053113,  0.006760948491302879,
                                        0.2556016749026026,    0.96678218011452,     0.0,
                                        -0.006536364522063772, 0.00172810975830724,  0.9999771445265626};
static const double half_sitting[TALOS_NQ] = {
    0, 0, 1.01927, 0, 0, 0, 1, 0, 0, -0.411354, 0.859395, -0.448041, 0, 0, 0, -0.411354, 0.859395, -0.448041, 0, 0,
    0.006761, 0.25847, 0.173046, -0.0002, -0.525366, 0, 0, 0.1, 0, -0.25847, -0.173046, 0.0002, -0.525366, 0, 0, 0.1, 0, 0, 0};

enum { Q_LEG = 7, Q_ARM_LEFT = 22, Q_ARM_RIGHT = 30 };

static void add(double sum[3], const double r[3], double m) {
    for (int i = 0; i < 3; i++) sum[i] += m * r[i];
}

/* (x, y, z) turned about x. */
static void roll(double angle, double y, double z, double out[3]) {
    double s = sin(angle), c = cos(angle);
    out[1] = c * y - s * z;
    out[2] = s * y + c * z;
}

/* Moment of one leg in base_link. Its pitch joints sum to zero, so that ankle5 and foot only roll. */
static void add_leg(const double *q, double side, double sum[3]) {
    double r[3], hip[3] = {-0.02, side * TALOS_HALF_STANCE, -TALOS_HIP};
    double s3 = sin(q[2]), c3 = cos(q[2]), s4 = sin(q[2] + q[3]), c4 = cos(q[2] + q[3]);
    double knee_x = -THIGH * s3, knee_z = -THIGH * c3, ankle_x = knee_x - SHANK * s4, ankle_z = knee_z - SHANK * c4;
    const double part[4][4] = {
        {hip2.m, hip2.x, hip2.y, hip2.z},
        {thigh.m, c3 * thigh.x + s3 * thigh.z, side * thigh.y, -s3 * thigh.x + c3 * thigh.z},
        {shank.m, knee_x + c4 * shank.x + s4 * shank.z, side * shank.y, knee_z - s4 * shank.x + c4 * shank.z},
        {ankle5.m, ankle_x + ankle5.x, side * ankle5.y, ankle_z + ankle5.z}};
    for (int i = 0; i < 4; i++) {
        roll(q[1], part[i][2], part[i][3], r);
        r[0] = hip[0] + part[i][1], r[1] += hip[1], r[2] += hip[2];
        add(sum, r, part[i][0]);
    }
    double f[3];
    roll(q[1], 0.0, ankle_z, r);
    roll(q[1] + q[5], foot.y, foot.z, f);
    r[0] = hip[0] + ankle_x + foot.x, r[1] += hip[1] + f[1], r[2] += hip[2] + f[2];
    add(sum, r, foot.m);
}

static void add_arm(double angle, int right, double sum[3]) {
    double side = right ? -1.0 : 1.0, r[3], c[3] = {arm[right].x, 0.0, 0.0};
    roll(angle, arm[right].y, arm[right].z, c);
    for (int i = 0; i < 3; i++) {
        const double *a = shoulder_axes + 3 * i;
        double mirror = i == 1 ? side : 1.0; /* the right shoulder's axes are the mirror image */
        r[i] = mirror * (shoulder[i] + a[0] * c[0] + a[1] * side * c[1] + a[2] * c[2]);
    }
    add(sum, r, arm[right].m);
}

void talos_com(const double q[TALOS_NQ], double com[3]) {
    double sum[3] = {trunk.m * trunk.x, trunk.m * trunk.y, trunk.m * trunk.z}, r[3];
    add_leg(q + Q_LEG, 1.0, sum);
    add_leg(q + Q_LEG + 6, -1.0, sum);
    add_arm(q[Q_ARM_LEFT], 0, sum);
    add_arm(q[Q_ARM_RIGHT], 1, sum);
    roll(2.0 * atan2(q[3], q[6]), sum[1] / TALOS_MASS, sum[2] / TALOS_MASS, r);
    com[0] = q[0] + sum[0] / TALOS_MASS, com[1] = q[1] + r[1], com[2] = q[2] + r[2];
}

static void set_base(double q[TALOS_NQ], double y, double z, double roll_angle) {
    q[1] = y, q[2] = z;
    q[3] = sin(0.5 * roll_angle), q[4] = q[5] = 0.0, q[6] = cos(0.5 * roll_angle);
}

/* Pitch joints of a leg whose ankle lies drop below the hip in the leg's plane. */
static void set_pitch(double *q, double drop) {
    double d = sqrt(ANKLE_X * ANKLE_X + drop * drop);
    if (d > REACH) d = REACH; /* a stretched leg leaves its foot behind */
    double c = (d * d - THIGH * THIGH - SHANK * SHANK) / (2.0 * THIGH * SHANK);
    q[3] = acos(c < -1.0 ? -1.0 : c);
    q[2] = atan2(-ANKLE_X, drop) - atan2(SHANK * sin(q[3]), THIGH + SHANK * cos(q[3]));
    q[4] = -q[2] - q[3];
}

static void hip_of(const double q[TALOS_NQ], double roll_angle, double side, double hip[3]) {
    roll(roll_angle, side * TALOS_HALF_STANCE, -TALOS_HIP, hip);
    hip[1] += q[1], hip[2] += q[2];
}

/* A leg that stands flat at (foot_y, lift). */
static void set_leg(double q[TALOS_NQ], double roll_angle, double side, double foot_y, double lift) {
    double hip[3], *leg = q + (side > 0.0 ? Q_LEG : Q_LEG + 6);
    hip_of(q, roll_angle, side, hip);
    double dy = foot_y - hip[1], dz = hip[2] - TALOS_ANKLE - lift;
    leg[1] = atan2(dy, dz) - roll_angle;
    leg[5] = -roll_angle - leg[1];
    set_pitch(leg, sqrt(dy * dy + dz * dz));
}

void talos_standing(const double c[C_SIZE], double q[TALOS_NQ]) {
    double com[3], y = c[C_Y], z = half_sitting[2];
    memcpy(q, half_sitting, sizeof half_sitting);
    q[Q_ARM_LEFT] = c[C_ARM_LEFT], q[Q_ARM_RIGHT] = -c[C_ARM_RIGHT];
    for (int i = 0; i < 60; i++) { /* the base follows the CoM by about 6/7: contraction below 0.2 */
        set_base(q, y, z, c[C_ROLL]);
        set_leg(q, c[C_ROLL], 1.0, c[C_LEFT], c[C_LIFT_LEFT]);
        set_leg(q, c[C_ROLL], -1.0, c[C_RIGHT], c[C_LIFT_RIGHT]);
        talos_com(q, com);
        double ey = c[C_Y] - com[1], ez = TALOS_COM_HEIGHT - com[2];
        if (fabs(ey) + fabs(ez) < 1e-15) break;
        y += ey * 1.18, z += ez * 1.18;
    }
}

void talos_falling(const double start[TALOS_NQ], double edge_y, double side, const double f[F_SIZE], double q[TALOS_NQ]) {
    memcpy(q, start, TALOS_NQ * sizeof *q);
    double roll0 = 2.0 * atan2(start[3], start[6]), hip[3], turned[3], up[3], ankle0[3], ankle[3];
    double *leg = q + (side > 0.0 ? Q_LEG : Q_LEG + 6);
    double leg0 = roll0 + leg[1];
    roll(roll0, 0.0, -TALOS_HIP, hip); /* middle of the hips at the start */
    hip[1] += start[1] - edge_y, hip[2] += start[2];
    roll(f[F_TURN], f[F_LENGTH] * hip[1], f[F_LENGTH] * hip[2], turned);
    roll(f[F_ROLL], 0.0, TALOS_HIP, up);
    set_base(q, edge_y + turned[1] + up[1], turned[2] + up[2], f[F_ROLL]);
    hip_of(start, roll0, side, ankle0); /* stance ankle: turns rigidly with the sole about the edge */
    double drop0 = THIGH * cos(leg[2]) + SHANK * cos(leg[2] + leg[3]);
    roll(leg0, 0.0, -drop0, up);
    roll(f[F_TURN], ankle0[1] + up[1] - edge_y, ankle0[2] + up[2], ankle);
    hip_of(q, f[F_ROLL], side, hip);
    double dy = edge_y + ankle[1] - hip[1], dz = hip[2] - ankle[2];
    leg[1] = atan2(dy, dz) - f[F_ROLL];
    leg[5] = f[F_TURN] - f[F_ROLL] - leg[1]; /* the sole was flat, now it has turned */
    set_pitch(leg, sqrt(dy * dy + dz * dz));
    double *other = q + (side > 0.0 ? Q_LEG + 6 : Q_LEG);
    other[1] = start[(side > 0.0 ? Q_LEG + 6 : Q_LEG) + 1] + roll0 + f[F_TURN] - f[F_ROLL];
    q[Q_ARM_LEFT] = f[F_ARM_LEFT], q[Q_ARM_RIGHT] = -f[F_ARM_RIGHT];
}
