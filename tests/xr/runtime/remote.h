#pragma once

#include <string>

namespace palpate::test::fake {

class World;

/// The runtime told from another process what to do, for programs that run unmodified: a FIFO named
/// by PALPATE_FAKE_XR_REMOTE, one command a line, looked at in every call.
///
///   input PATH VALUE                 a part of a controller, by its full path
///   tap PATH                         a button, pressed as the program sees it next, then let go;
///                                    of two taps the second one follows in the frame after
///   hand SIDE X Y Z [QX QY QZ QW]    0 left, 1 right: at rest there (room, m)
///   no-hand SIDE                     no controller is in it
///   fingers SIDE X Y Z GAP [DX DY DZ SECONDS]   a bare hand: its forefinger's tip, the air to the
///                                    thumb's; it goes on from there evenly
///   no-fingers SIDE                  the headset does not see it
///   glide SIDE DX DY DZ SECONDS      from where it is, evenly
///   path SIDE FILE                   rows of t_s x y z qx qy qz qw, t of the monotonic clock
///   head X Y Z
///   view WIDTH HEIGHT                of the next session's pictures
///   focus WIDTH HEIGHT               of its second pair's, where there are such views
///   profile PATH                     which controllers the next session's hands hold
///   rate HZ [HZ...]                  of the display; all that programs may choose from
///   without EXTENSION                the next instance is not offered it
///   headset on|off, runtime up|down, lose session|instance, pictures on
///   recentre X Y Z                   the stage's origin moves, and the runtime says how far
///   exit                             the person ends the session
///   tell FILE                        writes how it stands; FILE.ppm: both eyes' last picture,
///                                    FILE.focus.ppm: that of a second pair,
///                                    FILE.depth: floats, one eye after the other, m
class Remote {
 public:
  Remote();
  ~Remote();
  Remote(const Remote&) = delete;
  /// Executes the commands written since the last call. Called under the world's lock.
  void listen(World& world);

 private:
  int fifo_ = -1;
  std::string unread_;
};

}  // namespace palpate::test::fake
