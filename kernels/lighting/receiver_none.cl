/* Stands for lighting/receiver.cl where lights are chosen by the hemisphere alone to which a surface sends light: its
 * unit normal, 0 if it is the sphere. */
#define Receiver vec3
#define receiver_hemisphere(r) (r)
#define receiver_at(scene, row, hemisphere, away) (hemisphere)
#define receiver_reflects(r, wi, sine, cosine) (cosine)
