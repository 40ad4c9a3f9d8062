"""Phrases of derivations in French: English → French, with the same parts.

Signs of punctuation that stand apart do so by a space that does not break.
"""

from __future__ import annotations

FRENCH = {
    "{text}:": "{text}\u00a0:",
    "{text}.": "{text}.",
    "{name}: {value}": "{name}\u00a0: {value}",
    "{first} and {last}": "{first} et {last}",
    "{name} on {place}": "{name} sur {place}",
    "{value} for {name}": "{value} pour {name}",
    "on {place}": "sur {place}",
    "none": "aucune",
    "None.": "Aucune.",
    "There are none.": "Il n'y en a pas.",
    "There are {listed}.": "Il y a {listed}.",
    "Here": "Ici",
    "By the constraints": "Par les liaisons",
    "({count} operations)": "({count} opérations)",
    "Expressions of more than {most} operations are left out; {option} prints them.": (
        "Les expressions de plus de {most} opérations sont omises\u00a0; {option} les écrit."
    ),
    "System": "Système",
    "Sketch": "Croquis",
    "Particle: {listed}.": "Particule\u00a0: {listed}.",
    "Particles: {listed}.": "Particules\u00a0: {listed}.",
    "{name} of mass {mass} at {place}": "{name} de masse {mass} en {place}",
    "Parameter": "Paramètre",
    "Parameter: {listed}.": "Paramètre\u00a0: {listed}.",
    "Parameters: {listed}.": "Paramètres\u00a0: {listed}.",
    "Parameters": "Paramètres",
    "Meaning": "Signification",
    "Value": "Valeur",
    "Unit": "Unité",
    "{coordinate} at the start": "{coordinate} au départ",
    "Inputs": "Entrées",
    "Outputs": "Sorties",
    "column {column} of {file}, linear between rows": (
        "colonne {column} de {file}, linéaire entre les lignes"
    ),
    "column {column} of {file}, a cubic spline through the rows": (
        "colonne {column} de {file}, spline cubique passant par les lignes"
    ),
    "column {column} of {file}, each row until the next": (
        "colonne {column} de {file}, chaque ligne jusqu'à la suivante"
    ),
    "DOF": "ddl",
    "Degrees of freedom": "Degrés de liberté",
    "{count} Cartesian coordinate": "{count} coordonnée cartésienne",
    "{count} Cartesian coordinates": "{count} coordonnées cartésiennes",
    "{count} independent constraint": "{count} liaison indépendante",
    "{count} independent constraints": "{count} liaisons indépendantes",
    "{count} degree of freedom": "{count} degré de liberté",
    "{count} degrees of freedom": "{count} degrés de liberté",
    "{count} coordinate": "{count} coordonnée",
    "{count} coordinates": "{count} coordonnées",
    "no particles": "aucune particule",
    "{count} further coordinate": "{count} autre coordonnée",
    "{count} further coordinates": "{count} autres coordonnées",
    "{count} nonholonomic constraint": "{count} liaison non holonome",
    "{count} nonholonomic constraints": "{count} liaisons non holonomes",
    "{count} one-sided constraint": "{count} liaison unilatérale",
    "{count} one-sided constraints": "{count} liaisons unilatérales",
    "{count} constraint built into the positions": ("{count} liaison contenue dans les positions"),
    "{count} constraints built into the positions": "{count} liaisons contenues dans les positions",
    "(implied)": "(implicites)",
    "Constraints": "Liaisons",
    "Constraints:": "Liaisons\u00a0:",
    "satisfied by the definitions": "vérifiée par les définitions",
    " on a part of the configurations": " pour une partie des configurations",
    "redundant": "redondante",
    "redundant, implied by {listed}": "redondante, impliquée par {listed}",
    "one-sided": "unilatérale",
    "restitution {value}": "restitution {value}",
    "nonholonomic": "non holonome",
    "holonomic": "holonome",
    "scleronomic": "scléronome",
    "rheonomic": "rhéonome",
    "(all)": "(toutes)",
    "all": "toutes",
    "Coordinates": "Coordonnées",
    "(chosen automatically)": "(choisies automatiquement)",
    "Generalized coordinate: {listed}.": "Coordonnée généralisée\u00a0: {listed}.",
    "{names} for {ranges}": "{names} pour {ranges}",
    "Here {sizes}.": "Ici {sizes}.",
    "Before the first elements and after the last": (
        "Avant les premiers éléments et après les derniers"
    ),
    "Generalized coordinates: {listed}.": "Coordonnées généralisées\u00a0: {listed}.",
    "Generalized coordinate (chosen automatically): {listed}.": (
        "Coordonnée généralisée (choisie automatiquement)\u00a0: {listed}."
    ),
    "Generalized coordinates (chosen automatically): {listed}.": (
        "Coordonnées généralisées (choisies automatiquement)\u00a0: {listed}."
    ),
    "No coordinate is left: nothing can move.": (
        "Il ne reste aucune coordonnée\u00a0: rien ne peut bouger."
    ),
    "The positions are": "Les positions sont",
    "Singular": "Singularité",
    "{names} where": "{names} là où",
    "The motion of {names} is singular where {zero}.": (
        "Le mouvement de {names} est singulier là où {zero}."
    ),
    "Formulation": "Formulation",
    "minimal ({why}): {minimal} operations predicted for a right-hand side beside"
    " {multiplier} of multiplier": (
        "minimale ({why})\u00a0: {minimal} opérations prévues pour un second membre, contre"
        " {multiplier} avec multiplicateurs"
    ),
    "multiplier ({why}): {multiplier} operations predicted for a right-hand side beside"
    " {minimal} of minimal": (
        "avec multiplicateurs ({why})\u00a0: {multiplier} opérations prévues pour un second"
        " membre, contre {minimal} sous forme minimale"
    ),
    "as asked": "comme demandé",
    "fewer operations": "moins d'opérations",
    "the coordinates are declared": "les coordonnées sont déclarées",
    "Lagrangian": "Lagrangien",
    "The kinetic energy, the potential and the Lagrangian are": (
        "L'énergie cinétique, le potentiel et le lagrangien sont"
    ),
    "The kinetic energy, the generalized potential and the Lagrangian are": (
        "L'énergie cinétique, le potentiel généralisé et le lagrangien sont"
    ),
    "The kinetic energy, the potential, the Lagrangian and the dissipation function are": (
        "L'énergie cinétique, le potentiel, le lagrangien et la fonction de dissipation sont"
    ),
    "The kinetic energy, the generalized potential, the Lagrangian and the dissipation"
    " function are": (
        "L'énergie cinétique, le potentiel généralisé, le lagrangien et la fonction de"
        " dissipation sont"
    ),
    "Here {lagrangian} is {without}.": "Ici, {lagrangian} est écrit {without}.",
    "{terms} in {lagrangian} holds no coordinate and no velocity: it changes no equation"
    " of motion.": (
        "{terms} dans {lagrangian} ne contient ni coordonnée ni vitesse et ne change aucune"
        " équation du mouvement."
    ),
    "without constants": "sans constantes",
    "without functions of {time} alone": "sans fonctions de {time} seul",
    "without constants and functions of {time} alone": (
        "sans constantes ni fonctions de {time} seul"
    ),
    "Generalized forces": "Forces généralisées",
    "Of the non-conservative forces ({listed}), in this order:": (
        "Celles des forces non conservatives ({listed}), dans cet ordre\u00a0:"
    ),
    "Equations of motion": "Équations du mouvement",
    "Lagrange's equations": "Équations de Lagrange",
    "Lagrange's equations,": "Les équations de Lagrange,",
    "read": "s'écrivent",
    "(divided by {factor})": "(divisée par {factor})",
    "(multiplied by {factor})": "(multipliée par {factor})",
    "{factor} in the equation for {place}": "{factor} dans l'équation de {place}",
    "{factor} in that for {place}": "{factor} dans celle de {place}",
    "the equation for {place} by {factor}": "l'équation de {place} par {factor}",
    "that for {place} by {factor}": "celle de {place} par {factor}",
    "Common factor divided out: {listed}.": "Facteur commun simplifié\u00a0: {listed}.",
    "Common factors divided out: {listed}.": "Facteurs communs simplifiés\u00a0: {listed}.",
    "Multiplied to be rid of fractions: {listed}.": (
        "Multiplication pour éliminer les fractions\u00a0: {listed}."
    ),
    "Solved for the accelerations": "Résolues par rapport aux accélérations",
    "Solved for the accelerations and multipliers": (
        "Résolues par rapport aux accélérations et aux multiplicateurs"
    ),
    "Not solved for the accelerations, as a linear system": (
        "Non résolues par rapport aux accélérations, sous forme de système linéaire"
    ),
    " where few are coupled, the others as a linear system": (
        " là où peu sont couplées, les autres sous forme de système linéaire"
    ),
    " with the closure equations, differentiated": " avec les équations de fermeture dérivées",
    "; contacts determine their multipliers": (
        "\u00a0; les contacts déterminent leurs multiplicateurs"
    ),
    "{unknowns}) = {forcing} with": "{unknowns}) = {forcing} avec",
    "none: nothing can move": "aucune\u00a0: rien ne peut bouger",
    "Result": "Résultat",
    "Abbreviations": "Abréviations",
    "Closure equations": "Équations de fermeture",
    "These hold beside the equations of motion; their left sides are the {letter}.": (
        "Elles s'ajoutent aux équations du mouvement\u00a0; leurs premiers membres sont les"
        " {letter}."
    ),
    "These hold beside the equations of motion; their left sides are {phi}, or {psi} where"
    " they hold velocities.": (
        "Elles s'ajoutent aux équations du mouvement\u00a0; leurs premiers membres sont {phi},"
        " ou {psi} là où ils contiennent des vitesses."
    ),
    "The multiplier times the gradient of the left side is the force that the constraint exerts": (
        "Le multiplicateur fois le gradient du premier membre est la force exercée par la liaison"
    ),
    "The multiplier times the gradient of the left side by the velocities is the force that"
    " the constraint exerts": (
        "Le multiplicateur fois le gradient du premier membre par rapport aux vitesses est"
        " la force exercée par la liaison"
    ),
    "The multiplier times the gradient of the left side (by the velocities where it holds"
    " them) is the force that the constraint exerts": (
        "Le multiplicateur fois le gradient du premier membre (par rapport aux vitesses là"
        " où il en contient) est la force exercée par la liaison"
    ),
    "Contacts": "Contacts",
    "The gaps {gap} of one-sided constraints and their multipliers obey": (
        "Les distances {gap} des liaisons unilatérales et leurs multiplicateurs vérifient"
    ),
    "here": "ici",
    "Times the gradient of the gap, {push} is the force of the contact. A gap that closes"
    " with {closing} opens with {opening}; the restitution {elastic} is {listed}.": (
        "Fois le gradient de la distance, {push} est la force de contact. Une distance qui"
        " se ferme avec {closing} s'ouvre avec {opening}\u00a0; le coefficient de restitution"
        " {elastic} vaut {listed}."
    ),
    "Where a gap is 0 its multiplier is at least 0, and times the gradient of the gap it is"
    " the force of the contact; where a gap is open its multiplier is 0": (
        "Là où une distance est nulle, son multiplicateur est positif ou nul et, fois le"
        " gradient de la distance, c'est la force de contact\u00a0; là où une distance est"
        " ouverte, son multiplicateur est nul"
    ),
    "A gap that closes opens again with the speed of its closing times its restitution": (
        "Une distance qui se ferme s'ouvre de nouveau avec la vitesse de sa fermeture fois"
        " son coefficient de restitution"
    ),
    "Constraint forces": "Forces de liaison",
    "beside applied forces; by constraints the multiplier times the gradient": (
        "à côté des forces appliquées\u00a0; pour les liaisons, le multiplicateur fois le gradient"
    ),
    "force on {place}": "force sur {place}",
    "the accelerations are those of the equations of motion": (
        "les accélérations sont celles des équations du mouvement"
    ),
    "multipliers and accelerations are those of the equations of motion": (
        "les multiplicateurs et les accélérations sont ceux des équations du mouvement"
    ),
    "the force on {bodies} is not unique: what {listed} exerts is written in"
    " coordinates, and acts on no particle": (
        "la force sur {bodies} n'est pas unique\u00a0: ce qu'exerce {listed} est écrit en"
        " coordonnées et n'agit sur aucune particule"
    ),
    "the forces on {bodies} are not unique: what {listed} exerts is written in"
    " coordinates, and shared among them in no way that is stated": (
        "les forces sur {bodies} ne sont pas uniques\u00a0: ce qu'exerce {listed} est"
        " écrit en coordonnées, et rien ne dit comment elles se le partagent"
    ),
    "the scene gives {listed} no weight": "la scène ne donne pas de poids à {listed}",
    "these include the term {listed}, because it is written in coordinates": (
        "elles comprennent le terme {listed}, parce qu'il est écrit en coordonnées"
    ),
    "these include the terms {listed}, because they are written in coordinates": (
        "elles comprennent les termes {listed}, parce qu'ils sont écrits en coordonnées"
    ),
    "multipliers that are not determined, or have no short form: {listed}": (
        "multiplicateurs indéterminés ou sans forme courte\u00a0: {listed}"
    ),
    "Conserved": "Conservés",
    "Conserved quantities": "Grandeurs conservées",
    "among cyclic momenta and energy": "parmi les impulsions cycliques et l'énergie",
    "No cyclic momentum is conserved, and neither is the energy.": (
        "Aucune impulsion cyclique n'est conservée, et l'énergie ne l'est pas non plus."
    ),
    "angular momentum about the {axis} axis": "moment cinétique autour de l'axe {axis}",
    "{momentum} is the angular momentum about the {axis} axis.": (
        "{momentum} est le moment cinétique autour de l'axe {axis}."
    ),
    "{name} is cyclic": "{name} est cyclique",
    "{lagrangian} does not depend on {time}": "{lagrangian} ne dépend pas de {time}",
    "{lagrangian} does not depend on {time} (between impacts)": (
        "{lagrangian} ne dépend pas de {time} (entre les chocs)"
    ),
    "{reason}, so {symbol} is conserved": "{reason}, donc {symbol} est conservé",
    "not decided: {names}": "non décidé\u00a0: {names}",
    "Of {names} this is not decided.": "Pour {names}, ce n'est pas décidé.",
    "Energy": "Énergie",
    "Along a motion {energy} changes at the given rate": (
        "Au cours d'un mouvement, {energy} varie au taux indiqué"
    ),
    " between impacts": " entre les chocs",
    "Initial values": "Valeurs initiales",
    "The scene gives none.": "La scène n'en donne pas.",
    "At {time}": "À {time}",
    "at rest.": "au repos.",
    "Certificate": "Certificat",
    "Certified at {count} random state to {digits} digits, largest mismatch {mismatch}": (
        "Vérifié pour {count} état aléatoire à {digits} chiffres, plus grand écart {mismatch}"
    ),
    "Certified at {count} random states to {digits} digits, largest mismatch {mismatch}": (
        "Vérifié pour {count} états aléatoires à {digits} chiffres, plus grand écart {mismatch}"
    ),
    "At {count} random state these equations were compared, in arithmetic of {digits} digits,"
    " with Lagrange's equations evaluated from {lagrangian} itself; the largest relative"
    " mismatch was {mismatch}.": (
        "Pour {count} état aléatoire, ces équations ont été comparées, avec {digits}"
        " chiffres, aux équations de Lagrange évaluées à partir de {lagrangian}\u00a0; le plus"
        " grand écart relatif était {mismatch}."
    ),
    "At {count} random states these equations were compared, in arithmetic of {digits}"
    " digits, with Lagrange's equations evaluated from {lagrangian} itself; the largest"
    " relative mismatch was {mismatch}.": (
        "Pour {count} états aléatoires, ces équations ont été comparées, avec {digits}"
        " chiffres, aux équations de Lagrange évaluées à partir de {lagrangian}\u00a0; le plus"
        " grand écart relatif était {mismatch}."
    ),
    "Every line of the steps compared at {count} of these states to {digits} digits, largest"
    " mismatch {mismatch}": (
        "Chaque ligne des étapes comparée pour {count} de ces états à {digits} chiffres,"
        " plus grand écart {mismatch}"
    ),
    "Every line of the steps was compared at {count} of these states with automatic"
    " differentiation: the largest mismatch was {mismatch}.": (
        "Chaque ligne des étapes a été comparée pour {count} de ces états à une dérivation"
        " automatique\u00a0: le plus grand écart était {mismatch}."
    ),
    "Positions": "Positions",
    "{listed} is a coordinate itself.": "{listed} est une coordonnée elle-même.",
    "{listed} are coordinates themselves.": "{listed} sont des coordonnées elles-mêmes.",
    "Velocities": "Vitesses",
    "By the chain rule": "D'après la dérivation des fonctions composées",
    "Partial derivatives that are not written vanish.": (
        "Les dérivées partielles qui ne sont pas écrites sont nulles."
    ),
    "Accelerations": "Accélérations",
    "The velocities are differentiated by time once more.": (
        "Les vitesses sont dérivées encore une fois par rapport au temps."
    ),
    "Virtual displacements": "Déplacements virtuels",
    "Coordinates are displaced at a fixed time:": (
        "Les coordonnées sont déplacées à temps fixé\u00a0:"
    ),
    "Lagrangian without potential": "Lagrangien sans potentiel",
    "Kinetic energy": "Énergie cinétique",
    "Potential energy": "Énergie potentielle",
    "Generalized potential": "Potentiel généralisé",
    "Dissipation function": "Fonction de dissipation",
    "The virtual work of the forces defines them:": (
        "Le travail virtuel des forces les définit\u00a0:"
    ),
    "The force {name} on {place}:": "La force {name} sur {place}\u00a0:",
    "It does no virtual work.": "Elle n'effectue aucun travail virtuel.",
    "Together:": "Ensemble\u00a0:",
    "{force} is a torque: {q} is an angle.": "{force} est un moment, car {q} est un angle.",
    "Constraints with multipliers": "Liaisons avec multiplicateurs",
    "Beside the equations of motion {listed} vanishes.": (
        "En plus des équations du mouvement, {listed} s'annule."
    ),
    "Beside the equations of motion {listed} vanish.": (
        "En plus des équations du mouvement, {listed} s'annulent."
    ),
    "{listed} is the gap of a contact.": "{listed} est la distance d'un contact.",
    "{listed} are gaps of contacts.": "{listed} sont les distances de contacts.",
    "For {place}:": "Pour {place}\u00a0:",
    "so that": "de sorte que",
    "and, divided by {factor},": "et, en divisant par {factor},",
    "and, multiplied by {factor},": "et, en multipliant par {factor},",
    "Applied forces": "Forces appliquées",
    "No applied force acts on a particle.": "Aucune force appliquée n'agit sur une particule.",
    "d'Alembert's principle": "Principe de d'Alembert",
    "Constraint forces do no work in virtual displacements that the constraints allow:": (
        "Les forces de liaison ne travaillent pas dans les déplacements virtuels"
        " compatibles avec les liaisons\u00a0:"
    ),
    "The {listed} are restricted by the constraints that are kept: with a multiplier for each"
    " of these, every coefficient vanishes.": (
        "Les {listed} sont restreints par les liaisons conservées\u00a0: avec un multiplicateur"
        " pour chacune d'elles, chaque coefficient s'annule."
    ),
    "The {listed} are independent, so the coefficient of each vanishes.": (
        "Les {listed} sont indépendants, donc le coefficient de chacun s'annule."
    ),
    "{listed} is written in coordinates and acts on no particle: its inertia less force is"
    " {further}.": (
        "{listed} est écrit en coordonnées et n'agit sur aucune particule\u00a0: son inertie"
        " moins sa force est {further}."
    ),
    "{listed} are written in coordinates and act on no particle: their inertia less force is"
    " {further}.": (
        "{listed} sont écrits en coordonnées et n'agissent sur aucune particule\u00a0: leur"
        " inertie moins leur force est {further}."
    ),
    "The same by Lagrange's equations": "Le même résultat par les équations de Lagrange",
    "nothing": "rien",
    "{difference} at most, relative to their terms": (
        "{difference} au plus, relativement à leurs termes"
    ),
    "Evaluated from {lagrangian} at {count} random state in {digits} digits, these differ"
    " from the coefficients above by {size}: both ways give the same equations.": (
        "Évaluées à partir de {lagrangian} pour {count} état aléatoire avec {digits}"
        " chiffres, elles diffèrent des coefficients ci-dessus de {size}\u00a0: les deux voies"
        " donnent les mêmes équations."
    ),
    "Evaluated from {lagrangian} at {count} random states in {digits} digits, these differ"
    " from the coefficients above by {size}: both ways give the same equations.": (
        "Évaluées à partir de {lagrangian} pour {count} états aléatoires avec {digits}"
        " chiffres, elles diffèrent des coefficients ci-dessus de {size}\u00a0: les deux voies"
        " donnent les mêmes équations."
    ),
    "Newton's equations": "Équations de Newton",
    "The constraint forces that make up the difference are listed below.": (
        "Les forces de liaison qui font la différence sont données plus bas."
    ),
    "Cyclic coordinates, momenta and energy": "Coordonnées cycliques, impulsions et énergie",
    "{lagrangian} depends on every coordinate.": ("{lagrangian} dépend de toutes les coordonnées."),
    "{listed} does not stand in {lagrangian}, but forces or constraints change its momentum.": (
        "{listed} ne figure pas dans {lagrangian}, mais des forces ou des liaisons changent"
        " son impulsion."
    ),
    "{listed} do not stand in {lagrangian}, but forces or constraints change their momenta.": (
        "{listed} ne figurent pas dans {lagrangian}, mais des forces ou des liaisons"
        " changent leurs impulsions."
    ),
    "{name} is cyclic, {slope}, and its momentum is conserved,": (
        "{name} est cyclique, {slope}, et son impulsion est conservée,"
    ),
    "The energy function is": "La fonction énergie est",
    "It changes at the rate": "Elle varie au taux",
    "It is conserved, since {slope}": "Elle est conservée, car {slope}",
    " and the forces do no work": " et les forces ne travaillent pas",
    ", between impacts": ", entre les chocs",
    "; it is {energy}": "\u00a0; c'est {energy}",
    "; it is not {energy}": "\u00a0; ce n'est pas {energy}",
    # -- equilibrium by virtual work
    "Principle of virtual work": "Principe des travaux virtuels",
    "A system stays at rest if the applied forces do no work in the virtual displacements that"
    " the constraints allow; constraint forces do none:": (
        "Un système reste au repos si les forces appliquées ne travaillent pas dans les"
        " déplacements virtuels que les liaisons permettent\u00a0; les forces de liaison ne"
        " travaillent pas\u00a0:"
    ),
    "Equilibrium": "Équilibre",
    "These equations have no solution in closed form that was found.": (
        "Aucune solution de ces équations en forme close n'a été trouvée."
    ),
    "No configuration satisfies these equations: the forces cannot balance.": (
        "Aucune configuration ne satisfait ces équations\u00a0: les forces ne peuvent se compenser."
    ),
    "These equations are satisfied exactly by": ("Ces équations sont satisfaites exactement par"),
    "These equations are satisfied, among others perhaps, by": (
        "Ces équations sont satisfaites, peut-être entre autres, par"
    ),
    "Here {names} is not 0.": "Ici {names} n'est pas nul.",
    "Here {names} are not 0.": "Ici aucun de {names} n'est nul.",
    "any {names}": "{names} quelconque",
    "any {names} where": "{names} quelconque avec",
    "provided that": "à condition que",
    "or": "ou",
}
