/* Stands for lights/kept_hemisphere.cl where no light is chosen by it. */
#define path_receiver(path, at) v3(0.0f, 0.0f, 0.0f)
#define path_receiver_keep(path, at, m, receiver) ((void)0)
