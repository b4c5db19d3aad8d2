; The mill's lines and registers, and names for them.

; --- lines -----------------------------------------------------------------------------------
M0->X:$0,0,24,U             ; servo cycles since power-up
M9->Y:$FFC2,8,8,U           ; machine outputs 1 to 8
M11->Y:$FFC2,0,1            ; machine inputs 1 to 8, for watching and simulating
M12->Y:$FFC2,1,1
M13->Y:$FFC2,2,1
M14->Y:$FFC2,3,1
M15->Y:$FFC2,4,1
M16->Y:$FFC2,5,1
M17->Y:$FFC2,6,1
M18->Y:$FFC2,7,1
M19->Y:$FFC2,0,8,U          ; the same as a byte
M29->Y:$FFC0,8,8,U          ; the panel's eight keys, 0 while pressed
M90->X:$0700,0,24,S         ; timers, in servo cycles
M91->Y:$0700,0,24,S

; --- image words, in the open registers from $7F0 --------------------------------------------
M60->X:$07F0,0,8,U          ; inputs as PLC2 read them
M61->X:$07F0,0,1            ; the tool is clamped
M62->X:$07F0,1,1            ; the tool is unclamped
M63->X:$07F0,2,1            ; there is pressure in the lubrication
M64->X:$07F0,3,1            ; there is oil
M65->X:$07F0,4,1            ; there is air
M66->X:$07F0,5,1            ; the guard is closed
M67->X:$07F0,6,1            ; the spindle stands
M70->X:$07F1,0,8,U          ; keys as PLC2 read them, 1 while pressed
M71->X:$07F1,0,1
M72->X:$07F1,1,1
M73->X:$07F1,2,1
M74->X:$07F1,3,1
M75->X:$07F1,4,1
M76->X:$07F1,5,1
M77->X:$07F1,6,1
M78->X:$07F1,7,1
M80->X:$07F2,0,8,U          ; outputs as PLC31 will write them
M81->X:$07F2,0,1
M82->X:$07F2,1,1
M83->X:$07F2,2,1
M84->X:$07F2,3,1
M85->X:$07F2,4,1
M86->X:$07F2,5,1
M87->X:$07F2,6,1

; --- motor 1, for the encoder watch in PLCC1 -------------------------------------------------
L1->X:$C001,0,24,S          ; encoder counter
L2->Y:$C003,8,16,S          ; DAC output
L3->X:$07F4,0,24,S          ; the counter as it was when it last moved
L4->X:$07F5,0,24,S          ; scans since then with the motor driven
L5->X:$07F6,0,1             ; 1: the encoder is lost
M50->X:$07F6,0,1

; --- names -----------------------------------------------------------------------------------
#define TOOL_CLAMPED    (M61=1)
#define TOOL_UNCLAMPED  (M62=1)
#define OIL_PRESSURE    (M63=1)
#define OIL_LEVEL       (M64=1)
#define SAFE_TO_OPEN    (M65=1 AND M66=1 AND M67=1)

#define KEY_JOG_MINUS   M71
#define KEY_JOG_PLUS    M72
#define KEY_UNCLAMP     M73
#define KEY_START       M74
#define KEY_OVERRIDE    M75
#define KEY_STOP        M76
#define KEY_HOME        M77
#define KEY_RESET       M78

#define PUMP            M81
#define UNCLAMP_VALVE   M82
#define TAPER_BLOW      M83
#define LAMP_READY      M84
#define LAMP_FAULT      M85
#define LAMP_CYCLE      M86
#define DRIVES_ON       M87
#define ENCODER_LOST    M50

#define MSEC            8388608/I10
#define LUBE_TIMER      M90
#define CLAMP_TIMER     M91

#define LUBE_INTERVAL   P20     ; ms between two strokes of the pump
#define LUBE_STROKE     P21     ; ms of one
#define CLAMP_LIMIT     P22     ; ms that the clamp may take
#define LUBE_STROKES    P23     ; strokes so far
#define PRESSURE_SEEN   P24
#define OVERRIDE        P25     ; per cent

; A fault's number is also what the display shows. Statements, as macros may be.
#define FAULT           P30
#define NO_FAULT        0
#define FAULT_OIL       1
#define FAULT_PRESSURE  2
#define FAULT_CLAMP     3
#define FAULT_UNCLAMP   4
#define FAULT_ENCODER   5
#define SHOW_FAULT      DISPLAY 60"FAULT"DISPLAY 66,2.0,FAULT
#define SHOW_OVERRIDE   DISPLAY 40,5.1,OVERRIDE
