#define SECOND P20
P20=0
