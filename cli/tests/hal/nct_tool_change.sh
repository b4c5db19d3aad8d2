# A tool change of examples/desk/changer.nct by nct_strobe: M6 is handed over, the turret is played by hand, FIN comes back.
halcmd loadrt threads name1=servo-thread period1=1000000
halcmd loadrt example
halcmd loadrt nct_strobe
halcmd addf nct-strobe.0 servo-thread
halcmd addf example.tick servo-thread
halcmd setp example.rh000 6
halcmd setp example.rh006 2
halcmd net strobe nct-strobe.0.strobe example.i520
halcmd net fin example.y547 nct-strobe.0.done
is() { for _ in $(seq 1000); do [ "$(halcmd getp $1)" != $2 ] || { echo "ok $1 $2" >>printed; return 0; }; sleep 0.01; done; echo "$1 is not $2: $(halcmd getp $1)" >>printed; return 1; }
for p in i000 i540 i015; do halcmd setp example.$p TRUE; done
halcmd start
is example.y547 TRUE
halcmd setp nct-strobe.0.request TRUE
is example.y547 FALSE
is nct-strobe.0.fin FALSE
is example.y011 TRUE
halcmd setp example.i015 FALSE; halcmd setp example.i014 TRUE
is example.y010 TRUE
halcmd setp example.i01 $((2 + 16)); halcmd setp example.i013 TRUE
is example.y010 FALSE
halcmd setp example.i014 FALSE; halcmd setp example.i015 TRUE
is nct-strobe.0.fin TRUE
halcmd setp nct-strobe.0.request FALSE
is nct-strobe.0.fin FALSE
