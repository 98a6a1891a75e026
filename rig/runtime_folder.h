// The folder for what the processes of one user on one host share while they run: the bus's key, the arm's control
// socket.
//
// The first of these that the environment names, or the last:
//   $RUNTIME_DIRECTORY          systemd's, for a unit with RuntimeDirectory= (of several, the first)
//   $XDG_RUNTIME_DIR/selvedge   a login's
//   /tmp/selvedge-UID           neither; UID is the user's number, also in a user namespace of its own
// Sources: systemd.exec(5), the XDG Base Directory Specification 0.8, user_namespaces(7).
#pragma once

#include <filesystem>

namespace selvedge::rig {

// Makes the folder with mode 0700 where it is missing. Throws BadInput with the folder's name where it cannot be
// made, is a link or no folder, belongs to another user, or may be written by others.
std::filesystem::path runtime_folder();

// The folder for what must outlive the user's login and a loss of power. The first of these that the environment names:
//   $STATE_DIRECTORY            systemd's, for a unit with StateDirectory= (of several, the first)
//   $XDG_STATE_HOME/selvedge
//   $HOME/.local/state/selvedge
// Made where it is missing, and durable then. Throws BadInput where the environment names none, or it cannot be made.
std::filesystem::path state_folder();

}  // namespace selvedge::rig
