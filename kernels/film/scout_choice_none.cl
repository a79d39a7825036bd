/* Stands for film/scout_choice.cl where no path scouts. */
#define scout_choice(scene, key, state, dimension, u) (u)
