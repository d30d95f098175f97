#pragma once

#include "common/mavlink/frames.h"
#include "common/mavlink/framing.h"
#include "common/mavlink/payload.h"
#include "common/mavlink/px4_mode.h"
#include "common/mavlink/signing.h"

/// The names of common/mavlink that this folder is about.
namespace chase::fcu {

namespace mav = mavlink::mav;

using mavlink::As;
using mavlink::Frame;
using mavlink::FrameReader;
using mavlink::FrameWriter;
using mavlink::Key;
using mavlink::Signing;

using mavlink::IsByStick;
using mavlink::kLandMode;
using mavlink::kOffboardMode;
using mavlink::Mode;

using mavlink::BodySwap;
using mavlink::SwapBody;
using mavlink::SwapFrames;
using mavlink::SwapWorld;
using mavlink::WorldSwap;

}  // namespace chase::fcu
