/*
 * Addresses and limits of the cell @CELL@, as its file states them.
 *
 * Written by elastocal @VERSION@; do not edit: change the cell file, sign the sheet of krc-config
 * again, and export again.
 */
#ifndef LIVE_CONFIG_H
#define LIVE_CONFIG_H

#include "elastocal_model.h"

/* RSI: this machine, and the only controller that is read and answered. */
#define LIVE_RSI_ADDRESS "@RSI_ADDRESS@"
#define LIVE_RSI_PORT @RSI_PORT@
#define LIVE_ROBOT_ADDRESS "@ROBOT_ADDRESS@"
#define LIVE_SENTYPE "@SENTYPE@"
#define LIVE_TIMEOUT @TIMEOUT@ /* cycles without an answer after which the controller stops */
#define LIVE_DELAY_CYCLES @DELAY_CYCLES@ /* from a correction to its motion, at most */

/* Net F/T. */
#define LIVE_FT_ADDRESS "@FT_ADDRESS@"
#define LIVE_FT_PORT @FT_PORT@
#define LIVE_FT_TCP_PORT @FT_TCP_PORT@
#define LIVE_EVERY_RECORD @EVERY_RECORD@ /* 1: filters run at the rate of the box */

/* Last bounds of every answer, whatever the compensator gives. */
#define LIVE_LARGEST @LARGEST@ /* m */
#define LIVE_STEP @STEP@ /* m in a cycle */
#define LIVE_FADE_STEP @FADE_STEP@ /* m in a cycle, at the end */

/* Joints of the model from E1 ... and A1 to A6 of the controller, in mm and deg. */
#define LIVE_EXTERNAL @EXTERNAL@
static const double LIVE_SCALE[ELASTOCAL_JOINTS] = {@SCALE@};

#endif
