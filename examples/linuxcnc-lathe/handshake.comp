component handshake "Hands a function of LinuxCNC to a program of an old control, and takes the answer";
description """
When the request comes, the code of the program (such as the pin lathe.at-m03) becomes TRUE. The program makes it FALSE when
the function is done: that is fin. A request that is taken away takes the code away too, so that nothing is done later that
nobody waits for.""";
pin in bit request "LinuxCNC wants the function";
pin io bit code "the code of the program";
pin out bit fin "the program has done it, and the request is still there";
variable int before = 0;
function _ nofp;
license "GPL";
;;
FUNCTION(_) {
    if (request && !before) code = 1;
    if (!request && before) code = 0;
    before = request;
    fin = request && !code;
}
