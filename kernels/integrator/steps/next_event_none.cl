/* Stands for integrator/steps/next_event.cl without lights, and at materials that send light one way only. */
typedef integer NextEvent;
#define next_event_wi(e, scatter) ((scatter).wo)
#define next_event_seek(scene, next, v, scatter) ((integer)(0))
#define next_event_weigh(scene, e, v, scatter, rival, guided, ratio) (e)
#define next_event_keep(scene, path, shadow, at, active, v, e) ((integer)(0))
