; The canonical domain of marsupial exploration for teams with batteries. PDDL 2.1.
;
; It is domain_seats.pddl, and so domain.pddl, with charges in joules and two actions more, recharge and recharge_aboard.
; Where no carrier has seats, all rovers fit, and each carrier has as many seats as places. Without batteries a problem
; is one of the other two domains.
;
; Exact: what drives, dockings and undockings take, and from which charge they are possible.
; Approximate, as PDDL 2.1 can't say more, or planners can't solve it:
; - Waiting on the ground takes nothing: nothing has effects outside of actions.
; - A robot sets off only if its charge suffices to get aboard or to a charging place afterwards, as if a carrier with a
;   free place stood there already. Who has too little at the beginning stays where it is.
; - Charging is an action. It takes as long as from empty, and ends with a full battery. In truth batteries charge at all
;   times aboard and at a charging place, and from where they are.
; - A rover aboard is always charged from its carrier's battery, if that has one; in truth not at a charging place.
; So a plan may need more charge than it says: `marsupial validate` knows what is true.

(define (domain marsupial_batteries)
  (:requirements :strips :typing :fluents :durative-actions)

  (:types
    robot location robot_type - object
    carrier rover - robot
    target waypoint start - location
    meeting home charging_place - waypoint)

  (:predicates
    (at ?r - robot ?x - location)
    (on ?e - rover ?c - carrier)
    (aboard ?e - rover)
    (explored ?t - target)
    (can_explore ?r - robot ?t - target)
    (can_stand ?e - rover ?m - meeting)
    (is_a ?r - robot ?k - robot_type)
    (fits ?e - rover ?k - robot_type ?c - carrier)
    (path ?k - robot_type ?x ?y - location)
    (can_charge ?r - robot)
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
    ; The capacity of the battery and its charge in J, and what standing and driving take and charging gives in W. All
    ; are 0 for a robot without a battery.
    (battery ?r - robot)
    (charge ?r - robot)
    (stand_power ?r - robot)
    (drive_power ?r - robot)
    (charge_power ?r - robot)
    ; 1 if the carrier charges rovers from a battery of its own, else 0.
    (gives ?c - carrier)
    ; How long the robot at a start is busy at first, which is part of path_cost but no driving; 0 elsewhere.
    (rest ?x - location)
    ; The least charge with which a robot of the type gets from there aboard or to a charging place.
    (back ?k - robot_type ?x - location)
    (free_at ?r - robot)
    (reveal ?t - target)
    (type_capacity ?k - robot_type)
    (type_seats ?k ?of - robot_type)
    (type_dock_time ?k - robot_type)
    (type_undock_time ?k - robot_type)
    (type_battery ?k - robot_type)
    (type_stand_power ?k - robot_type)
    (type_drive_power ?k - robot_type)
    (type_charge_power ?k - robot_type)
    (travel ?k - robot_type ?x ?y - location))

  (:durative-action move
    :parameters (?r - robot ?k - robot_type ?x - location ?y - waypoint)
    :duration (= ?duration (path_cost ?k ?x ?y))
    :condition (and
      (at start (at ?r ?x))
      (at start (is_a ?r ?k))
      (at start (path ?k ?x ?y))
      (at start (>= (charge ?r) (+ (* (drive_power ?r) (- (path_cost ?k ?x ?y) (rest ?x))) (back ?k ?y)))))
    :effect (and
      (at start (not (at ?r ?x)))
      (at start (decrease (charge ?r) (* (drive_power ?r) (- (path_cost ?k ?x ?y) (rest ?x)))))
      (at end (at ?r ?y))))

  (:durative-action explore
    :parameters (?r - robot ?k - robot_type ?x - location ?t - target)
    :duration (= ?duration (path_cost ?k ?x ?t))
    :condition (and
      (at start (at ?r ?x))
      (at start (is_a ?r ?k))
      (at start (path ?k ?x ?t))
      (at start (can_explore ?r ?t))
      (at start (>= (charge ?r) (+ (* (drive_power ?r) (- (path_cost ?k ?x ?t) (rest ?x))) (back ?k ?t)))))
    :effect (and
      (at start (not (at ?r ?x)))
      (at start (decrease (charge ?r) (* (drive_power ?r) (- (path_cost ?k ?x ?t) (rest ?x)))))
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
      (at start (<= (+ (num_seated ?c ?k) 1) (seats ?c ?k)))
      (at start (>= (charge ?e) (* (stand_power ?e) (dock_time ?e))))
      (at start (>= (charge ?c) (* (stand_power ?c) (dock_time ?e)))))
    :effect (and
      (at start (not (at ?e ?m)))
      (at start (not (at ?c ?m)))
      (at start (increase (num_docked ?c) 1))
      (at start (increase (num_seated ?c ?k) 1))
      (at start (decrease (charge ?e) (* (stand_power ?e) (dock_time ?e))))
      (at start (decrease (charge ?c) (* (stand_power ?c) (dock_time ?e))))
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
      (at start (can_stand ?e ?m))
      (at start (>= (charge ?e) (* (stand_power ?e) (undock_time ?e))))
      (at start (>= (charge ?c) (* (stand_power ?c) (undock_time ?e)))))
    :effect (and
      (at start (not (on ?e ?c)))
      (at start (not (aboard ?e)))
      (at start (decrease (charge ?e) (* (stand_power ?e) (undock_time ?e))))
      (at start (decrease (charge ?c) (* (stand_power ?c) (undock_time ?e))))
      (at start (not (at ?c ?m)))
      (at end (at ?c ?m))
      (at end (at ?e ?m))
      (at end (decrease (num_docked ?c) 1))
      (at end (decrease (num_seated ?c ?k) 1))))

  ; Charge to the full at a charging place. Planners such as Tamer know no duration that depends on the charge.
  (:durative-action recharge
    :parameters (?r - robot ?x - charging_place)
    :duration (= ?duration (/ (battery ?r) (charge_power ?r)))
    :condition (and
      (at start (can_charge ?r))
      (at start (<= (+ (charge ?r) 1) (battery ?r)))
      (over all (at ?r ?x)))
    :effect (at end (assign (charge ?r) (battery ?r))))

  ; Charge to the full aboard. The carrier gives its charge at the start, so that it can't be spent twice.
  (:durative-action recharge_aboard
    :parameters (?e - rover ?c - carrier)
    :duration (= ?duration (/ (battery ?e) (charge_power ?e)))
    :condition (and
      (at start (can_charge ?e))
      (at start (<= (+ (charge ?e) 1) (battery ?e)))
      (at start (>= (charge ?c) (* (gives ?c) (- (battery ?e) (charge ?e)))))
      (over all (on ?e ?c)))
    :effect (and
      (at start (decrease (charge ?c) (* (gives ?c) (- (battery ?e) (charge ?e)))))
      (at end (assign (charge ?e) (battery ?e))))))
