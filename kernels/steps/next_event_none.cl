/* Stands for steps/next_event.cl without lights, and at materials that send light one way only. */
typedef integer NextEvent;
#define next_event(scene, next, v, scatter, rival, guided, ratio) ((integer)(0))
#define next_event_keep(scene, path, shadow, at, active, v, e) ((integer)(0))
