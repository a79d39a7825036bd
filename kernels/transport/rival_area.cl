/* `merging_area` in the unit of rivals. */
#define rival_merging_area(scene, pass, v) (merging_area(scene, pass) / (scene).settings->rival_area)
