; The canonical domain of marsupial exploration, PDDL 2.1.
;
; Carriers and rovers explore targets; a carrier takes rovers along and sets them down and picks them up at meeting
; points. Times are seconds with three decimals: whole milliseconds, none of them lost. README.md beside this file
; explains every predicate and function; problems and plans to try are in examples/.

(define (domain marsupial)
  (:requirements :strips :typing :fluents :durative-actions)

  ; A waypoint is where robots go without exploring anything. A start is where one robot is when the plan begins, and
  ; belongs to that robot alone: nobody drives there. Two robots at one spot have two starts.
  (:types
    robot location robot_type - object
    carrier rover - robot
    target waypoint start - location
    meeting home - waypoint)

  (:predicates
    (at ?r - robot ?x - location)
    (on ?e - rover ?c - carrier)
    (aboard ?e - rover)
    (explored ?t - target)
    (can_explore ?r - robot ?t - target)
    (can_stand ?e - rover ?m - meeting)
    (is_a ?r - robot ?k - robot_type)
    (path ?k - robot_type ?x ?y - location)
    ; Records: no action reads them. They hold what a situation says beyond what planning needs.
    (role_carrier ?k - robot_type)
    (role_rover ?k - robot_type)
    (explores ?k - robot_type ?t - target)
    (home_of ?r - robot ?h - home)
    (recover_rovers)
    (return_home))

  (:functions
    (num_docked ?c - carrier)
    (capacity ?c - carrier)
    (path_cost ?k - robot_type ?x ?y - location)
    (dock_time ?e - rover)
    (undock_time ?e - rover)
    ; Records, as above.
    (free_at ?r - robot)
    (reveal ?t - target)
    (type_capacity ?k - robot_type)
    (type_dock_time ?k - robot_type)
    (type_undock_time ?k - robot_type)
    (travel ?k - robot_type ?x ?y - location))

  ; Drive to a meeting point or home.
  ; - ?k, the type of ?r, is a parameter so that costs are per type and not per robot: a table of a type is shared by
  ;   all its robots, which keeps a problem of 24 robots ten times smaller.
  ; - `at` goes at the start and comes back at the end: nobody is anywhere while driving, so nothing else can happen
  ;   to a robot meanwhile, and what follows a drive starts after its end.
  (:durative-action move
    :parameters (?r - robot ?k - robot_type ?x - location ?y - waypoint)
    :duration (= ?duration (path_cost ?k ?x ?y))
    :condition (and
      (at start (at ?r ?x))
      (at start (is_a ?r ?k))
      (at start (path ?k ?x ?y)))
    :effect (and
      (at start (not (at ?r ?x)))
      (at end (at ?r ?y))))

  ; Drive to a target and explore it.
  ; - `explored` holds at the end, since that is when it is true. A plan may send two robots to one target; that costs
  ;   time and does no harm, so no `(not (explored ?t))` is asked for. Negative conditions are avoided altogether
  ;   because POPF and OPTIC refuse them.
  (:durative-action explore
    :parameters (?r - robot ?k - robot_type ?x - location ?t - target)
    :duration (= ?duration (path_cost ?k ?x ?t))
    :condition (and
      (at start (at ?r ?x))
      (at start (is_a ?r ?k))
      (at start (path ?k ?x ?t))
      (at start (can_explore ?r ?t)))
    :effect (and
      (at start (not (at ?r ?x)))
      (at end (at ?r ?t))
      (at end (explored ?t))))

  ; Take a rover aboard.
  ; - `at` of both goes at the start, and the carrier's comes back at the end: both have to be there for all of it, and
  ;   a carrier docks or undocks one rover at a time and can't leave meanwhile. An `over all` condition would let two
  ;   rovers dock at once.
  ; - The place aboard is taken at the start, so that two dockings can't both count on the last one.
  ; - `(<= (+ n 1) c)` and not `(< n c)`: the validator VAL accepts a strict `<` between equals.
  (:durative-action dock
    :parameters (?e - rover ?c - carrier ?m - meeting)
    :duration (= ?duration (dock_time ?e))
    :condition (and
      (at start (at ?e ?m))
      (at start (at ?c ?m))
      (at start (<= (+ (num_docked ?c) 1) (capacity ?c))))
    :effect (and
      (at start (not (at ?e ?m)))
      (at start (not (at ?c ?m)))
      (at start (increase (num_docked ?c) 1))
      (at end (at ?c ?m))
      (at end (on ?e ?c))
      (at end (aboard ?e))))

  ; Set a rover down.
  ; - The carrier's `at` as in dock.
  ; - The place aboard is free at the end only: the rover stands on it until then.
  ; - `can_stand` is asked for here and not in dock: only a carried rover gets to a place too narrow for it.
  (:durative-action undock
    :parameters (?e - rover ?c - carrier ?m - meeting)
    :duration (= ?duration (undock_time ?e))
    :condition (and
      (at start (on ?e ?c))
      (at start (at ?c ?m))
      (at start (can_stand ?e ?m)))
    :effect (and
      (at start (not (on ?e ?c)))
      (at start (not (aboard ?e)))
      (at start (not (at ?c ?m)))
      (at end (at ?c ?m))
      (at end (at ?e ?m))
      (at end (decrease (num_docked ?c) 1)))))
