"""Changes of sessions from version to version: why a recording of an earlier one may come out otherwise."""

from typing import Final

from touchline.recordings.code_identity import own_version

SESSION_CHANGES: Final[dict[str, tuple[str, ...]]] = {
    "0.2.0": (
        (
            "A lidar's return near a robot needs two others of the same thing, beside it or in the two scans "
            "before, if the scan before looked through all the ground that a thing can have come from. Every drop "
            "of rain near by was a thing: in heavy rain (one false return in a thousand beams) robots stood for "
            "good, and in drizzle a job took five times as long."
        ),
        ("A contact counts as one in motion no longer if the robot is still pushed by what ran into it."),
        (
            "The estimator of a rear-steered robot no longer learns where its antenna is to the left: in bends to "
            "one side the slip of wheel and drum looked like an antenna up to 5 cm farther out, and the roller "
            "drove 2 cm beside its path."
        ),
        (
            "Where a robot with a lidar watches its way, a follower that commands it against that way is held to "
            "a creep of 2 cm/s: the speed was limited by the clearance ahead, and driven backward."
        ),
        (
            "A job whose robot stands for good beside something that may move ends though people pass by: each of "
            "them made it count anew, so that it stood without end."
        ),
        (
            "A rear-steered robot that the MPC steers no longer drives on against a leg's direction: off its "
            "heading at a cusp it corrected that in the wrong direction, 0.25 m over the boundary in one case."
        ),
        (
            "Patches of an area that a job has left out are cut where they surround covered ground: their "
            "outlines have no holes; the covered ground counted as left out."
        ),
        (
            "A robot that stands too near to things to drive another way to its goal backs off up to 4 m, no "
            "longer 0.8 m, and first turns by up to 30° where that leaves it more room. In mode `protect` a "
            "marker in a lane of 1.4 m with the goal behind it gave up."
        ),
        (
            "The margin of ways over known ground and among seen things ended in sharp points at the body's "
            "corners, 1.4 times as far out as at its sides; now they are cut off at 1.1 times. A robot with a "
            "corner beside a thing found no way off, though there was one, and ways were not found through gaps "
            "that are wide enough."
        ),
        (
            "A robot that stands takes a walking person before it for something that moves, though it does not "
            "know its heading yet: it compared three scans and allowed for twice an error of 0.36 m. A drive to a "
            "goal waits for 60 s, no longer for 15 s, while what is in its way moves, and plans nothing while "
            "that is so near that the robot may not move."
        ),
        (
            "A robot whose position is moved back, because the receiver has jumped or its estimate had run ahead "
            "of it, begins to paint further back by as much. It left a gap where the line had stopped: 0.37 m in "
            "one case."
        ),
        (
            "Obstacles that a goal's known ground has stand for protection and for plans, as those of a template "
            "do: they were taken for things that may move, and in mode `passive` a robot beside one stood for "
            "good. `PlanCause` has `known`. A robot so near to something else that may move that it may not move "
            "at all says so, with the distance that it needs and what to do; its drive to a goal ends with that "
            "reason instead of a proof that no way exists."
        ),
        (
            "The painted share that a robot believes and reports (`coverage_pct` of its status) counted segments "
            "by the robot's path instead of the lines that the nozzle draws: 64 % instead of 54 % in a job of "
            "three narrow bends."
        ),
        (
            "A robot whose job another process continues less than its run-up before a line first goes back for "
            "its heading. It drove on, paused at the line because the heading was uncertain, and only then went "
            "back."
        ),
        (
            "A robot that is nearer to something than it may be may come 2 cm nearer than it stood, but not "
            "nearer than 5 cm, and ways to goals are also looked for with the distance at which it stands: the "
            "noise of each scan stopped it. A robot whose lidars see all round may drive backward over ground "
            "that it has not seen. In mode `protect` robots that began beside a wall, or in a corner, gave up."
        ),
        (
            "The computer of the shipped marker expects its wheels to slide aside by 4 mm after a metre, no "
            "longer by 1 cm as that of an unknown robot: a burst of the receiver moves the estimate less. Of 16 "
            "soccer pitches (seeds 1 to 16) 13 are accepted instead of 9."
        ),
        (
            "Drives to a goal amid things that the plan does not know saw ground as free where beams without a "
            "return had not been placed: where they had passed before, or anywhere. Robots lost their way, and "
            "sessions were not repeatable."
        ),
        (
            "Ways to goals among things that may move keep the distance at which protection lets a robot come to "
            "rest. Beside the end of a wall a robot was stopped on way after way, and gave up."
        ),
        (
            "A robot that is nearer to something than it may be may drive on where it comes no nearer, though it "
            "is not exactly on its path; ways to goals begin by the error that hits have then, and keep what a "
            "long body needs to turn. In mode `protect` robots beside the end of a wall were stopped on way after "
            "way, and gave up."
        ),
        (
            "The filter's updates and the steps of the emulated world are calculated in another order, which "
            "changes the last digits."
        ),
        (
            "On rough ground the estimator took what gravity does to the accelerometer for wheels that slip, or "
            "for a slope of 30 %, and claimed σ of 14 mm where it was 18 cm off. It feels the body pitch and "
            "lean, and believes accelerometer and fixes less meanwhile. The fixes of a receiver that had jumped "
            "made it distrust itself a minute later; they do not count. A larger σ that one fault has taught is "
            "taken back by the evidence of the drive: a robot whose gyro had erred for 3 s stopped every 10 s for "
            "minutes."
        ),
        (
            "An estimator that no sensor had told the heading, since the magnetometer was silent at the start, "
            "started with heading 0, as if it knew that to 3°; it waits. Imported logs whose robot stood for a "
            "quarter of a second, but not for half of one, began like that. Logs without an IMU can be estimated."
        ),
        (
            "A guided robot that loses its pose stands before its place is less certain than r_s allows for, says "
            "so, and goes on as soon as it has a pose again; it used to drive on to a σ of 0.15 m. Where cameras "
            "leave a strip unseen it may come to rest there for good: give a larger `radius_m` "
            "(`docs/explanation/teams.md#without-a-pose`). `BeginGuided` has `margin_m`, `PlanState` has `stays`. "
            "Sessions by cells in which no pose is lost are the same."
        ),
        ("`grid-ways` shortens ways with the time that turns take, so that the last of many robots arrives sooner."),
        (
            "The estimator learns what a robot's files are wrong about: gyro scale, place of the antenna, stamp "
            "offset (`gnss.antenna_sigma_m`, `gnss.stamp_offset_sigma_s`, `imu.gyro_scale_sigma`). Until the "
            "motion has told it, the claimed σ has it; a difference is reported (`files-differ`), kept over jobs "
            "and restarts, and printed by `estimate`."
        ),
        (
            "The drift down a slope was taken to one side whatever the side of the slope, and put the heading off "
            "by three σ on 8 %. What is not known of the slope, and of the angle at which a robot drives aside of "
            "where it heads (`drive.crab_rad`), is in the claimed covariance; robots outdoors expect slopes of 2 "
            "%, and to wander by 1 cm a metre."
        ),
        (
            "The emulated receiver errs as a moving one does: in bursts that last for seconds "
            "(`gnss.burst_share`), beside a wander of 4.3 mm over 300 s, and the data sheet of the robot's "
            "computer (`gnss`) is of such a receiver. Before, the tail was drawn anew for each fix, which made "
            "the robot look better than it is. Recordings and files with all fields of `gnss` keep what they have."
        ),
        (
            "A robot that is guided by plans and is to stand follows its plan to the end instead of braking at "
            "once, so that others keep off it; teams by plans may have the faults `camera-outage`, "
            "`camera-swapped` and `battery-low`."
        ),
        (
            "A robot of a team whose wheels cannot both brake and turn as asked brakes first: it could leave its "
            "cell by 3 cm, and touch a wall."
        ),
        (
            "Lines that obstacles hide from each other are reached over a map of the ground by a robot that turns "
            "on the spot; most plans among many obstacles take less time."
        ),
        (
            "Plans of lines for a vehicle with a lidar keep 0.20 m off the obstacles of a template, as its "
            "protection asks for: it no longer stops at each of them. Parts of a line that meet are shortened "
            "beside the obstacle first."
        ),
        ("Obstacles of a template are in the emulated world: a robot that drives against one is stopped by it."),
        (
            "A drive to a goal without Zenoh records the sprayer's state in its first tick only if that has "
            "changed; recordings of such drives by 0.1.0 are read, not checked."
        ),
    ),
}
"""Lines marked [session] of CHANGELOG.md, by the version that brought them; the oldest first."""


def changes_since(recorded: str, made_by: str) -> list[str]:
    """Return remarks on a recording made by other code.

    Args:
        recorded: Its version; empty if unknown.
        made_by: Its code in words; empty if it is the present one.
    """
    if not made_by:
        return []
    since = [line for number, lines in SESSION_CHANGES.items() if _parts(number) > _parts(recorded) for line in lines]
    changed = f"; since then: {'; '.join(since)}" if since else ""
    return [f"recorded by {made_by}, checked by {own_version()}{changed}"]


def _parts(number: str) -> tuple[int, ...]:
    return tuple(int(part) for part in number.split(".") if part.isdigit())
