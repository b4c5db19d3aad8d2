// names of both glass cutters
#ifndef CUTTER_NAMES
#define CUTTER_NAMES
#define state     p30
#define alarm     p31
#define force     p32
#define metres    p33
#define tmr       i5111
#define millisec  *8388608/i10
#define go_button m30
#define hood      m31
#define vacuum_ok m32
#define clamped   m33
#define tilted    m34
#define ack       m35
#define force_out m47
#define lift_all  m42=0 HEAD2_UP
#define clamp_on  m40=1
#define clamp_off m40=0
#define tilt_up   m44=1;
#define tilt_down m44=0;
#define horn_on   m45=1;
#define horn_off  m45=0;
m30->y:$78400,0 m31->y:$78400,1 m32->y:$78400,2 m33->y:$78400,3
m34->y:$78400,4 m35->y:$78400,5
m40->y:$78402,0 m42->y:$78402,2 m43->y:$78402,3 m44->y:$78402,4
m45->y:$78402,5 m46->y:$78402,6 m59->*
m52->y:$78400,6 m53->y:$78400,7
m47->y:$078012,8,16,s
#endif
