/* Body regions of ISO/TS 15066 Annex A as commonly cited: how much force they stand, and how they yield.
 * A region is a mass behind a spring (Table A.3); its quasi-static limit is that of Table A.2, the transient one twice
 * that, but for skull and face, where any transient contact is beyond the limit. */
#ifndef BODY_H
#define BODY_H

typedef struct {
    double limit;     /* N, quasi-static contact */
    double transient; /* factor for transient contact; 1 where none is permitted */
    double stiffness; /* N/m */
    double mass;      /* kg, effective */
} BodyRegion;

static const BodyRegion body_face = {65.0, 1.0, 75000.0, 4.4};
static const BodyRegion body_chest = {140.0, 2.0, 25000.0, 40.0};
static const BodyRegion body_abdomen = {110.0, 2.0, 10000.0, 40.0};
static const BodyRegion body_pelvis = {180.0, 2.0, 25000.0, 40.0};
static const BodyRegion body_upper_arm = {150.0, 2.0, 30000.0, 3.0};
static const BodyRegion body_forearm = {160.0, 2.0, 40000.0, 2.0};
static const BodyRegion body_hand = {140.0, 2.0, 75000.0, 0.6};
static const BodyRegion body_thigh = {220.0, 2.0, 50000.0, 75.0};
static const BodyRegion body_lower_leg = {130.0, 2.0, 60000.0, 75.0};

#endif
