(a tool change by hand)
N10 M3 S500
N20 T5
N30 M6
N40 G1 X2 F600
N50 M30
