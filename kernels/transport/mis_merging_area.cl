/* `merging_area` in units of mis_area_unit. */
#define mis_merging_area(scene, pass, v) (merging_area(scene, pass) / (scene).settings->mis_area_unit)
