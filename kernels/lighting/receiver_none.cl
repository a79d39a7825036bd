/* Stands for lighting/receiver.cl where lights are chosen by the side alone to which a surface sends light: the unit
 * normal of that hemisphere, 0 if it is the sphere. */
#define Receiver vec3
#define receiver_hemisphere(r) (r)
#define receiver_reflects(r, wi, spread, cosine) (cosine)
