// used by others
#define LIMIT_SWITCH M12
#define OUT_ONE      M1
M12->Y:$FFC2,1,1
M1->Y:$FFC2,8,1
