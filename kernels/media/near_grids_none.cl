/* Stands for media/near_grids.cl where there are no grids. */
#define flight_near_share(name, share) (share)
