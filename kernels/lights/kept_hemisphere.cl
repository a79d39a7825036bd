/* The hemisphere to which the surface sends light where a ray was chosen: lights are chosen by it. */
#define path_receiver(path, at) load_path_sampled_hemisphere(path, at)
#define path_receiver_keep(path, at, m, receiver) store_path_sampled_hemisphere(path, at, m, receiver)

/* Twin, where no light is chosen by it. */
#define path_receiver(path, at) v3(0.0f, 0.0f, 0.0f)
#define path_receiver_keep(path, at, m, receiver) ((void)0)
