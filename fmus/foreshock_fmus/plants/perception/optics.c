/* Image formation: illumination, a scattering layer, automatic exposure, blur and pixel noise, as statistics. */
#include "model.h"

/* Brightness and its spread behind a layer of optical depth tau: Koschmieder's law, with airlight. */
static void scene(const Plant *self, const double *vars, double *mean, double *sd) {
    const double through = vars[V_cause] < 0.5 ? exp(-self->depth) : 1.0;
    *mean = self->illumination * (vars[V_reflectance] * through + vars[V_airlight] * (1.0 - through));
    *sd = self->illumination * vars[V_reflectance_sd] * through;
}

Image optics_image(const Plant *self, const double *vars) {
    double mean, sd;
    scene(self, vars, &mean, &sd);
    const double unit = vars[V_exposure_target] / vars[V_reflectance]; /* gain of the clear scene */
    const double gain = unit * self->exposure, blur = vars[V_cause] > 1.5 ? vars[V_blur_scale] * self->depth : 0.0;
    const double coarse = 1.0 / (1.0 + 0.25 * blur * blur), fine = exp(-0.5 * blur * blur);
    const double bright = gain * mean + vars[V_pedestal], spread = gain * sd * coarse;
    const double clear = unit * vars[V_reflectance_sd] / (vars[V_exposure_target] + vars[V_pedestal]);
    const double relative = spread / bright / clear;
    const double ratio = spread / (self->exposure * vars[V_read_noise] + 1e-12), half = vars[V_noise_tolerance];
    const double ratio_clear = unit * vars[V_reflectance_sd] / (vars[V_read_noise] + 1e-12);
    Image image;
    image.luminance = clip(bright, 0.0, 1.0);
    image.contrast = clip(spread / bright, 0.0, 1.0);
    image.sharpness = clip(relative * relative * fine * fine, 0.0, 1.0);
    image.saturated = 0.5 * erfc((1.0 - bright) / (spread + 1e-9) / sqrt(2.0));
    image.visibility = relative * fine * (ratio / (ratio + half)) / (ratio_clear / (ratio_clear + half));
    if (self->spoilt) image.visibility *= vars[V_glitch_visibility];
    return image;
}

void optics_frame(Plant *self, const double *vars, double t) {
    const double tiny = 1e-6, begin = vars[V_cause_time], rate = vars[V_cause_rate];
    const double span = rate > 0.0 ? vars[V_cause_depth] / rate : 0.0;
    /* exact over one frame: linear growth, then exponential settling */
    if (t >= begin - tiny && t < begin + span - tiny) self->depth = fmin(self->depth + rate * FRAME, vars[V_cause_depth]);
    else self->depth *= exp(-FRAME / vars[V_clear_time]);
    const double lamp = t >= vars[V_lamp_time] - tiny ? vars[V_lamp_level] : 1.0;
    self->illumination = lamp * (vars[V_cause] > 0.5 && vars[V_cause] < 1.5 ? exp(-vars[V_light_scale] * self->depth) : 1.0);
    double mean, sd;
    scene(self, vars, &mean, &sd);
    const double wanted = clip(vars[V_reflectance] / mean, 0.05, vars[V_exposure_most]);
    self->exposure += (1.0 - exp(-FRAME / vars[V_exposure_time])) * (wanted - self->exposure);
    self->spoilt = (double)(stream_next(&self->process) >> 11) * 0x1p-53 < vars[V_glitch_share];
    self->image = optics_image(self, vars);
}
