; The canonical domain of marsupial exploration for teams with seats: rovers that fit only some carriers, or only a few
; of a type at a time. PDDL 2.1.
;
; It is domain.pddl, which explains everything else, with the predicate fits, the functions seats and num_seated, and a
; parameter more in dock and undock. Without seats a problem is one of domain.pddl.

(define (domain marsupial_seats)
  (:requirements :strips :typing :fluents :durative-actions)

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
    ; The rover takes a seat for type ?k on the carrier.
    (fits ?e - rover ?k - robot_type ?c - carrier)
    (path ?k - robot_type ?x ?y - location)
    (role_carrier ?k - robot_type)
    (role_rover ?k - robot_type)
    (explores ?k - robot_type ?t - target)
    (home_of ?r - robot ?h - home)
    (seats_as ?k ?of - robot_type)
    (recover_rovers)
    (return_home))

  (:functions
    (num_docked ?c - carrier)
    (capacity ?c - carrier)
    (num_seated ?c - carrier ?k - robot_type)
    (seats ?c - carrier ?k - robot_type)
    (path_cost ?k - robot_type ?x ?y - location)
    (dock_time ?e - rover)
    (undock_time ?e - rover)
    (free_at ?r - robot)
    (reveal ?t - target)
    (type_capacity ?k - robot_type)
    (type_seats ?k ?of - robot_type)
    (type_dock_time ?k - robot_type)
    (type_undock_time ?k - robot_type)
    (travel ?k - robot_type ?x ?y - location))

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

  (:durative-action dock
    :parameters (?e - rover ?k - robot_type ?c - carrier ?m - meeting)
    :duration (= ?duration (dock_time ?e))
    :condition (and
      (at start (at ?e ?m))
      (at start (at ?c ?m))
      (at start (fits ?e ?k ?c))
      (at start (<= (+ (num_docked ?c) 1) (capacity ?c)))
      (at start (<= (+ (num_seated ?c ?k) 1) (seats ?c ?k))))
    :effect (and
      (at start (not (at ?e ?m)))
      (at start (not (at ?c ?m)))
      (at start (increase (num_docked ?c) 1))
      (at start (increase (num_seated ?c ?k) 1))
      (at end (at ?c ?m))
      (at end (on ?e ?c))
      (at end (aboard ?e))))

  (:durative-action undock
    :parameters (?e - rover ?k - robot_type ?c - carrier ?m - meeting)
    :duration (= ?duration (undock_time ?e))
    :condition (and
      (at start (on ?e ?c))
      (at start (at ?c ?m))
      (at start (fits ?e ?k ?c))
      (at start (can_stand ?e ?m)))
    :effect (and
      (at start (not (on ?e ?c)))
      (at start (not (aboard ?e)))
      (at start (not (at ?c ?m)))
      (at end (at ?c ?m))
      (at end (at ?e ?m))
      (at end (decrease (num_docked ?c) 1))
      (at end (decrease (num_seated ?c ?k) 1)))))
