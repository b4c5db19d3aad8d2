component nct_strobe "Hands a function of LinuxCNC to a program of an NCT control: a strobe of one slice, and its answer FIN.";
description """
When the request comes, the strobe (such as the pin mill.i520) is TRUE for one slice, which is 20 ms, so that the program sees it once. Afterwards FIN
(the pin mill.y547) is asked: fin is TRUE once the program has said that all functions are done. A program that takes FIN away when it
sees the strobe, and gives it back when the function is done, is waited for.""";
pin in bit request "LinuxCNC wants the function; its number lies in the register already";
pin in bit done "FIN of the program";
pin out bit strobe "the strobe";
pin out bit fin "the program has done it, and the request is still there";
param rw u32 slice_ns = 20000000 "the length of a slice";
variable int before = 0;
variable int left = 0;
function _ nofp;
license "GPL";
;;
FUNCTION(_) {
    if (request && !before) left = (slice_ns + period - 1) / period;
    if (!request) left = 0;
    before = request;
    strobe = left > 0;
    fin = request && !strobe && done;
    if (left > 0) left--;
}
