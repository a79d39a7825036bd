/* Stands for lights/receiver.cl where only its `hemisphere` matters. */
#define Receiver vec3
#define receiver_hemisphere(r) (r)
#define receiver_at(scene, row, hemisphere, away) (hemisphere)
#define receiver_reflects(r, wi, sine, cosine) (cosine)
